//! Three-dimensional shapes of the plant: stem, hook, bud, cotyledons and leaves of a pose.
//!
//! Picture and ground truth are both computed from these shapes, so that they agree. Sizes of organs are chosen by hand.

use tropism::geometry::Point;
use tropism::math;
use tropism::math::vector::{Vec3, add, along, cross, distance, dot, norm, normalize_or, scale, sub};

use crate::pose::{Leaf, Node, Pose};
use crate::view::{CAMERA, Frame, project};

/// Hours over which the last of the apical hook straightens: the paper starts right after it has opened.
const HOOK_OPENS: f64 = 6.0;

/// Subdivisions between two nodes of the stem. Chosen by hand.
const FINE: usize = 5;

/// Everything of the plant that can be seen.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// The stem, smooth, from the base to the apex.
    pub(super) stem: Vec<Node>,
    /// Index of the cotyledons' place on the stem, or of the place where they were.
    pub(super) node: usize,
    /// What is left of the apical hook, from the apex on; empty when it has opened.
    pub(super) hook: Vec<Node>,
    /// The terminal bud.
    pub(super) bud: Oval,
    /// The cotyledons; none when they have fallen.
    pub(super) cotyledons: Vec<Oval>,
    /// How far the cotyledons have withered, 0 to 1.
    pub(super) withered: f64,
    /// The primary leaves.
    pub(super) leaves: [Blade; 2],
}

/// An egg-shaped organ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oval {
    pub(super) centre: Vec3,
    /// Half the long axis.
    pub(super) half: Vec3,
    /// Half the short axis, in cm.
    pub(super) wide: f64,
}

/// A leaf with its petiole.
#[derive(Clone, Debug)]
pub(super) struct Blade {
    pub(super) petiole: Vec<Node>,
    /// From where the petiole meets the blade to the blade's end.
    pub(super) midrib: [Vec3; 2],
    /// The halves' edges, each from the petiole's end to the blade's end.
    pub(super) halves: [Vec<Vec3>; 2],
    /// Unit vectors that the halves' upper faces face.
    pub(super) normals: [Vec3; 2],
}

impl Body {
    pub(super) fn new(pose: &Pose) -> Self {
        let stem = smooth(&pose.stem);
        // Cotyledons stand at right angles to the primary leaves, whose pair is in the plane of `along` and the stem.
        let side = pose.leaves[0].across;
        let hook = hook(pose, side);
        let end = hook.last().or(stem.last()).map_or([0.0; 3], |node| node.at);
        let heading = match hook.as_slice() {
            [.., last, end] => normalize_or(sub(end.at, last.at), pose.heading),
            _ => pose.heading,
        };
        let bud = Oval { centre: sub(end, scale(heading, 0.12)), half: scale(heading, 0.26), wide: 0.14 };
        let withered = pose.withered;
        let node = cotyledonary(&stem);
        let cotyledons =
            if withered < 1.0 { cotyledons(&stem[node..], side, pose.age_h, withered) } else { Vec::new() };
        let leaves = core::array::from_fn(|which| Blade::new(&pose.leaves[which], pose.spread));
        Self { stem, node, hook, bud, cotyledons, withered, leaves }
    }

    /// Puts what is nearer to the camera than `nearest` cm to this distance, and what is behind it also aside, out of any picture:
    /// projection needs places before the camera.
    pub(super) fn keep_off(&mut self, nearest: f64) {
        let keep = |place: &mut Vec3, beyond: f64| {
            let off = sub(*place, CAMERA);
            let aside = normalize_or([off[0], off[1], 0.0], [1.0, 0.0, 0.0]);
            let far = if off[2] < 0.0 { 0.0 } else { (10.0 * (nearest + beyond) - dot(off, aside)).max(0.0) };
            *place = along(*place, aside, far);
            place[2] = place[2].min(CAMERA[2] - nearest - beyond);
        };
        let [one, other] = &mut self.leaves;
        for node in
            [&mut self.stem, &mut self.hook, &mut one.petiole, &mut other.petiole].into_iter().flatten()
        {
            keep(&mut node.at, 0.0);
        }
        for leaf in [one, other] {
            leaf.midrib.iter_mut().chain(leaf.halves.iter_mut().flatten()).for_each(|place| keep(place, 0.0));
        }
        for oval in self.cotyledons.iter_mut().chain([&mut self.bud]) {
            keep(&mut oval.centre, norm(oval.half).max(oval.wide));
        }
    }

    /// Discs that hold the plant as the camera sees it: centre and radius, in cm; of each oval `places` points of its outline.
    pub(super) fn discs(&self, places: usize) -> impl Iterator<Item = (Point, f64)> {
        let ribbons = [&self.stem, &self.hook, &self.leaves[0].petiole, &self.leaves[1].petiole];
        let disc = |node: &Node| (project(node.at), node.radius * nearness(node.at));
        let ovals = self.cotyledons.iter().chain([&self.bud]).flat_map(move |oval| oval.outline(places));
        let blades = self.leaves.iter().flat_map(|leaf| leaf.halves.iter().flatten().copied().map(project));
        ribbons.into_iter().flatten().map(disc).chain(ovals.chain(blades).map(|point| (point, 0.0)))
    }

    /// The highest point of the plant as the camera sees it.
    pub(super) fn top(&self) -> Point {
        let highest = self.discs(32).map(|(centre, radius)| Point::new(centre.x, centre.y + radius));
        highest.max_by(|a, b| a.y.total_cmp(&b.y)).unwrap_or(Point::new(0.0, 0.0))
    }
}

/// How much larger something at `at` looks than in the plane of the pot's axis.
pub(super) fn nearness(at: Vec3) -> f64 {
    CAMERA[2] / (CAMERA[2] - at[2])
}

/// A curve through the nodes (Catmull-Rom), so that a stem of few segments shows no corners.
fn smooth(nodes: &[Node]) -> Vec<Node> {
    let at = |index: isize| &nodes[index.clamp(0, nodes.len() as isize - 1) as usize];
    let mut curve = Vec::with_capacity(nodes.len() * FINE);
    for index in 0..nodes.len().saturating_sub(1) {
        let [a, b, c, d] = [-1, 0, 1, 2].map(|offset| at(index as isize + offset));
        for step in 0..FINE {
            let t = step as f64 / FINE as f64;
            let spline = |a: f64, b: f64, c: f64, d: f64| {
                b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
            };
            curve.push(Node {
                at: core::array::from_fn(|axis| spline(a.at[axis], b.at[axis], c.at[axis], d.at[axis])),
                radius: b.radius + t * (c.radius - b.radius),
            });
        }
    }
    curve.extend(nodes.last());
    curve
}

/// The part of `vector` at right angles to the unit vector `to`, at length 1.
fn square_to(vector: Vec3, to: Vec3) -> Vec3 {
    normalize_or(sub(vector, scale(to, dot(vector, to))), [1.0, 0.0, 0.0])
}

fn hook(pose: &Pose, side: Vec3) -> Vec<Node> {
    let closed = 1.0 - pose.age_h / HOOK_OPENS;
    let Some(end) = pose.stem.last().filter(|_| closed > 0.0) else { return Vec::new() };
    let side = square_to(side, pose.heading);
    let steps = 8;
    let mut at = end.at;
    let mut nodes = vec![*end];
    for step in 1..=steps {
        let turn = 2.4 * closed * f64::from(step) / f64::from(steps);
        let along = add(scale(pose.heading, math::cos(turn)), scale(side, math::sin(turn)));
        at = add(at, scale(along, 0.42 * closed / f64::from(steps)));
        nodes.push(Node { at, radius: end.radius });
    }
    nodes
}

/// Index of the place of the stem that bears the cotyledons.
fn cotyledonary(stem: &[Node]) -> usize {
    let length = |pair: &[Node]| distance(pair[1].at, pair[0].at);
    let whole: f64 = stem.windows(2).map(length).sum();
    // They are carried up while the hypocotyl below them still grows.
    let wanted = (0.72 * whole).min(5.5);
    let mut walked = 0.0;
    let mut is_below = |pair: &[Node]| {
        walked += length(pair);
        walked < wanted
    };
    stem.windows(2).take_while(|pair| is_below(pair)).count()
}

/// The pair of cotyledons at the foot of `stem`.
fn cotyledons(stem: &[Node], side: Vec3, age_h: f64, withered: f64) -> Vec<Oval> {
    let [foot, next, ..] = stem else { return Vec::new() };
    let pair = [foot, next];
    let along = normalize_or(sub(pair[1].at, pair[0].at), [0.0, 1.0, 0.0]);
    let side = square_to(side, along);
    // From half raised they sink, and shrivel.
    let raised = 0.55 - 1.3 * (age_h / 50.0).min(1.0);
    let size = 1.0 - 0.55 * withered;
    [1.0, -1.0]
        .map(|sign| {
            let out = scale(side, sign);
            let axis = add(scale(out, math::cos(raised)), scale(along, math::sin(raised)));
            let half = 0.75 * size;
            let near = add(pair[0].at, scale(out, 0.5 * pair[0].radius));
            Oval { centre: add(near, scale(axis, half)), half: scale(axis, half), wide: 0.40 * size }
        })
        .to_vec()
}

impl Oval {
    /// The outline as the camera sees it, in cm of the plane of the pot's axis.
    pub(super) fn outline(&self, places: usize) -> Vec<Point> {
        let view = sub(self.centre, CAMERA);
        let side = scale(normalize_or(cross(self.half, view), [1.0, 0.0, 0.0]), self.wide);
        // Seen along its axis an egg is round, not flat: the outline never gets thinner than the egg.
        let up = normalize_or(cross(view, side), [0.0, 1.0, 0.0]);
        let long = dot(self.half, up).abs().max(self.wide);
        let ahead = scale(up, if dot(self.half, up) < 0.0 { -long } else { long });
        (0..places)
            .map(|step| {
                let turn = core::f64::consts::TAU * step as f64 / places as f64;
                let (c, s) = (math::cos(turn), math::sin(turn));
                // A little broader towards its end.
                let breadth = s * (1.0 + 0.12 * c);
                project(add(self.centre, add(scale(ahead, c), scale(side, breadth))))
            })
            .collect()
    }
}

impl Blade {
    fn new(leaf: &Leaf, spread: f64) -> Self {
        // Folded leaves clasp each other: their blades are rolled along the midrib.
        let open = 0.45 + 0.55 * spread;
        let rolled = |place: Vec3| {
            let off = dot(sub(place, leaf.base), leaf.across);
            add(place, scale(leaf.across, (open - 1.0) * off))
        };
        const HALF: usize = 20;
        let edge: Vec<Vec3> = leaf.outline(HALF).into_iter().map(rolled).collect();
        let (first, second) = edge.split_at(HALF);
        let start = leaf.place(Leaf::PETIOLE, 0.0);
        let end = leaf.place(1.0, 0.0);
        let one = first.iter().copied().chain([end]).collect();
        let other = [start].into_iter().chain(second.iter().rev().copied()).collect();
        let radius = (0.018 * leaf.length).clamp(0.035, 0.09);
        let petiole = (0..=6)
            .map(|step| {
                let u = f64::from(step) / 6.0;
                Node { at: leaf.place(Leaf::PETIOLE * u, 0.0), radius: radius * (1.0 - 0.25 * u) }
            })
            .collect();
        let face = normalize_or(cross(leaf.along, leaf.across), [0.0, 1.0, 0.0]);
        let face = if face[1] < 0.0 { scale(face, -1.0) } else { face };
        let tilt =
            |sign: f64| normalize_or(add(face, scale(leaf.across, sign * (0.22 + 0.8 * (1.0 - open)))), face);
        Self { petiole, midrib: [start, end], halves: [one, other], normals: [tilt(-1.0), tilt(1.0)] }
    }

    /// The middle of the blade.
    pub(super) fn centre(&self) -> Vec3 {
        scale(add(self.midrib[0], self.midrib[1]), 0.5)
    }
}

/// The stem's middle as the camera sees it.
pub(super) fn midline(nodes: &[Node]) -> Vec<Point> {
    nodes.iter().map(|node| project(node.at)).collect()
}

/// The outline of a ribbon of round cross-sections as the camera sees it, in pixels; `part` cuts a strip out of it:
/// from -1, its left edge as it runs, to 1, its right edge. The whole ribbon ends in round caps.
pub(super) fn ribbon(nodes: &[Node], frame: Frame, part: [f64; 2]) -> Vec<[f64; 2]> {
    let mut centres: Vec<([f64; 2], f64)> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let pixel = frame.pixel(project(node.at));
        let radius = node.radius * nearness(node.at) * frame.px_per_cm;
        // Where the ribbon runs towards the camera, its direction in the picture is noise.
        let far = |last: &([f64; 2], f64)| math::hypot(pixel.x - last.0[0], pixel.y - last.0[1]);
        if centres.last().is_none_or(|last| far(last) > 0.3) {
            centres.push(([pixel.x, pixel.y], radius));
        }
    }
    let across = |index: usize| {
        let (from, to) = (index.saturating_sub(1), (index + 1).min(centres.len() - 1));
        let (dx, dy) = (centres[to].0[0] - centres[from].0[0], centres[to].0[1] - centres[from].0[1]);
        let far = math::hypot(dx, dy);
        if far > 1e-9 { [-dy / far, dx / far] } else { [1.0, 0.0] }
    };
    let edge = |index: usize, side: f64| {
        let (([x, y], radius), [nx, ny]) = (centres[index], across(index));
        [x + side * radius * nx, y + side * radius * ny]
    };
    let whole = part[0] <= -1.0 && part[1] >= 1.0;
    let cap = |index: usize, from: f64| {
        let ([x, y], radius) = centres[index];
        let [nx, ny] = across(index);
        (1..8).filter(move |_| whole).map(move |step| {
            let turn = core::f64::consts::PI * f64::from(step) / 8.0;
            let (c, s) = (from * math::cos(turn), from * math::sin(turn));
            // Around the end, from one edge to the other, away from the ribbon.
            [x + radius * (c * nx + s * ny), y + radius * (c * ny - s * nx)]
        })
    };
    let last = centres.len() - 1;
    let mut outline: Vec<[f64; 2]> = (0..=last).map(|index| edge(index, part[1])).collect();
    outline.extend(cap(last, 1.0));
    outline.extend((0..=last).rev().map(|index| edge(index, part[0])));
    outline.extend(cap(0, -1.0));
    outline
}
