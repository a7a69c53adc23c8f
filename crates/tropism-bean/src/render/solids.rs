//! Solids in a photograph, by sphere tracing: what the camera sees of them, what they hide, and where they cast shadows.
//!
//! # References
//! Hart 1996, doi:10.1007/s003710050084: a ray may go as far as the nearest surface is away.

use tropism::geometry::Point;
use tropism::math;
use tropism::math::vector::{Vec3, add, cross, dot, normalize_or, scale, sub};
use tropism::obstacle::{Bar, Obstacle, Solid};

use super::body::{Blade, Body, nearness};
use super::cloth::Texture;
use crate::pose::Node;
use crate::scene::Rgb;
use crate::solid::{FRONT, HALF_SHEET, distance};
use crate::view::{CAMERA, View, WALL, project};

/// Albedo of wood, across its dark and bright rings, and of sheet metal. Chosen by hand.
const WOOD: [Rgb; 2] = [[0.33, 0.19, 0.09], [0.52, 0.35, 0.19]];
const METAL: Rgb = [0.34, 0.35, 0.37];

/// Distance at which a ray has met a surface, in cm; far below a pixel. Chosen by hand.
const MET_CM: f64 = 0.004;
/// Longest step along a ray as a share of the distance from the nearest surface: perspective bends the flanks of obstacles.
/// Chosen by hand.
const CAUTION: f64 = 0.85;
/// Most steps along a ray. Chosen by hand: a ray that grazes a surface takes some tens.
const STEPS: u32 = 160;
/// Sharpness of shadows: the distance from a lamp over its radius. Chosen by hand.
const SHARPNESS: f64 = 9.0;

/// The solids of the tent as one camera sees them.
#[derive(Clone, Debug, Default)]
pub(super) struct Solids {
    pub(super) solids: Vec<Solid>,
    pub(super) view: View,
}

/// Where a ray meets a solid, in the camera's coordinates.
pub(super) struct SolidHit {
    pub(super) at: Vec3,
    pub(super) normal: Vec3,
    pub(super) colour: Rgb,
    pub(super) is_glossy: bool,
}

impl Solids {
    /// The nearest solid to a place of the camera's coordinates: distance, direction away from it in the tent, and number.
    fn nearest(&self, place: Vec3) -> (f64, Vec3, usize) {
        let place = self.view.to_tent(place);
        let mut nearest = (f64::INFINITY, [0.0; 3], 0);
        for (number, solid) in self.solids.iter().enumerate() {
            let (mut far, mut normal) = distance(solid, place);
            // An obstacle begins at the back wall.
            if matches!(solid, Solid::Plane(_)) && WALL - place[2] > far {
                (far, normal) = (WALL - place[2], [0.0, 0.0, -1.0]);
            }
            if far < nearest.0 {
                nearest = (far, normal, number);
            }
        }
        nearest
    }

    /// What a ray from the camera along `along` meets.
    pub(super) fn meet(&self, along: Vec3, texture: Texture) -> Option<SolidHit> {
        let (at, normal, number) = self.trace(along, MET_CM)?;
        let tent = self.view.to_tent(at);
        let (colour, is_glossy) = match &self.solids[number] {
            Solid::Plane(Obstacle::Line { .. }) => {
                (scale(METAL, 1.0 + 0.08 * texture.noise(44, 9.0 * tent[0], 9.0 * tent[1] + tent[2])), true)
            }
            Solid::Plane(obstacle) => (end_grain(obstacle, tent, texture), false),
            Solid::Pole(pole) => {
                (grain(texture, math::atan2(tent[0] - pole.at[0], tent[2] - pole.at[1]), tent[1]), false)
            }
            Solid::Bar(bar) => {
                let way = sub(tent, bar.ends[0]);
                let [first, second] = bar.across();
                let along = dot(way, cross(first, second));
                (grain(texture, math::atan2(dot(way, second), dot(way, first)), along), false)
            }
        };
        Some(SolidHit { at, normal: self.view.to_camera(normal), colour, is_glossy })
    }

    /// Whether a ray through a point of the plane of the pot's axis passes a solid within some pixels.
    pub(super) fn is_near(&self, point: Point) -> bool {
        !self.solids.is_empty() && self.trace(sub([point.x, point.y, 0.0], CAMERA), 0.3).is_some()
    }

    /// Follows a ray from the camera until a solid is within `near` cm: the place, the normal in the tent, and its number.
    fn trace(&self, along: Vec3, near: f64) -> Option<(Vec3, Vec3, usize)> {
        if self.solids.is_empty() {
            return None;
        }
        let ahead = normalize_or(along, [0.0, 0.0, -1.0]);
        // Nothing stands right before the camera.
        let mut far = 30.0;
        for _ in 0..STEPS {
            let at = add(CAMERA, scale(ahead, far));
            let (gap, normal, number) = self.nearest(at);
            if gap < near {
                return Some((at, normal, number));
            }
            far += (CAUTION * gap).max(MET_CM);
            if at[2] < self.view.wall() {
                break;
            }
        }
        None
    }

    /// Share of the light of a lamp at `lamp` that reaches `place`, both in the camera's coordinates: 1 without a shadow.
    pub(super) fn share_of_light(&self, place: Vec3, lamp: Vec3) -> f64 {
        if self.solids.is_empty() {
            return 1.0;
        }
        let way = sub(lamp, place);
        let whole = dot(way, way).sqrt();
        let ahead = scale(way, 1.0 / whole);
        let (mut far, mut share) = (0.3, 1.0_f64);
        for _ in 0..STEPS {
            if far > whole || share < 0.01 {
                break;
            }
            let gap = self.nearest(add(place, scale(ahead, far))).0;
            share = share.min(SHARPNESS * gap / far);
            far += (CAUTION * gap).max(0.02);
        }
        // Smoothstep: penumbra without an edge.
        let share = share.max(0.0);
        share * share * (3.0 - 2.0 * share)
    }

    /// Whether a solid stands between the camera and the part of the plant that is seen at a point of the plane of the pot's
    /// axis. `pixel_cm`: the width of a pixel there.
    pub(super) fn hides(&self, body: &Body, point: Point, pixel_cm: f64) -> bool {
        let hit = self.trace(sub([point.x, point.y, 0.0], CAMERA), MET_CM);
        hit.is_some_and(|(at, ..)| depth(body, point, pixel_cm).is_some_and(|depth| at[2] > depth))
    }

    /// The rectangle of the plane of the pot's axis in which solids are seen, as its lower left and upper right corner.
    pub(super) fn extent(&self) -> Option<(Point, Point)> {
        let corners = self.solids.iter().flat_map(|solid| {
            let ([left, low, back], [right, high, front]) = match solid {
                Solid::Plane(obstacle) => {
                    let (low, high) = obstacle.extent();
                    // Its flanks narrow towards the camera: at the wall it is broadest.
                    let wide = (CAMERA[2] - WALL) / CAMERA[2];
                    let at = |point: Point, axis: usize, from: f64| {
                        CAMERA[axis] + ([point.x, point.y][axis] - CAMERA[axis]) * from
                    };
                    let narrow = (CAMERA[2] - FRONT) / CAMERA[2];
                    let least = |axis| at(low, axis, wide).min(at(low, axis, narrow));
                    let most = |axis| at(high, axis, wide).max(at(high, axis, narrow));
                    let edge = HALF_SHEET;
                    ([least(0) - edge, least(1) - edge, WALL], [most(0) + edge, most(1) + edge, FRONT])
                }
                Solid::Pole(pole) => {
                    let ([x, z], radius) = (pole.at, pole.radius_cm);
                    ([x - radius, -1.0, z - radius], [x + radius, pole.height_cm.min(60.0), z + radius])
                }
                Solid::Bar(Bar { ends: [one, other], radius_cm }) => {
                    let least = [0, 1, 2].map(|axis| one[axis].min(other[axis]) - radius_cm);
                    (least, [0, 1, 2].map(|axis| one[axis].max(other[axis]) + radius_cm))
                }
            };
            (0..8).map(move |corner: u32| {
                let pick = |bit: u32, low: f64, high: f64| if corner >> bit & 1 == 0 { low } else { high };
                project(self.view.to_camera([pick(0, left, right), pick(1, low, high), pick(2, back, front)]))
            })
        });
        corners.map(|corner| (corner, corner)).reduce(|(low, high), (one, other)| {
            (
                Point::new(low.x.min(one.x), low.y.min(one.y)),
                Point::new(high.x.max(other.x), high.y.max(other.y)),
            )
        })
    }
}

/// Wood between its dark and its bright rings.
fn wood(share: f64) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    core::array::from_fn(|band| WOOD[0][band] + share * (WOOD[1][band] - WOOD[0][band]))
}

/// Wood along the grain of a round bar, at an angle about its axis, in rad, and at a distance along it, in cm.
fn grain(texture: Texture, turn: f64, along: f64) -> Rgb {
    let streak =
        texture.noise(41, 5.0 * turn, 0.18 * along) + 0.6 * texture.noise(42, 14.0 * turn, 0.5 * along);
    wood(0.5 + 0.4 * streak)
}

/// A sawn end with the rings of its years, or a flank with its grain.
fn end_grain(obstacle: &Obstacle, place: Vec3, texture: Texture) -> Rgb {
    if place[2] < FRONT - 0.05 {
        return wood(0.5 + 0.45 * texture.noise(43, 0.3 * place[2], 4.0 * (place[0] + place[1])));
    }
    let inside = obstacle.distance(project(place));
    let wavy = inside + 0.05 * texture.noise(45, 2.0 * place[0], 2.0 * place[1]);
    wood(0.55 + 0.35 * math::sin(30.0 * wavy))
}

/// z of the front of the plant at a point of the picture; `None` where there is none of it within a pixel.
fn depth(body: &Body, point: Point, pixel_cm: f64) -> Option<f64> {
    let ribbons = [&body.stem, &body.hook, &body.leaves[0].petiole, &body.leaves[1].petiole];
    let nodes = ribbons.into_iter().flatten().filter(|node| covers(node, point, pixel_cm));
    let ovals = body.cotyledons.iter().chain([&body.bud]);
    let ovals = ovals.filter(|oval| {
        let radius = oval.wide.max(dot(oval.half, oval.half).sqrt()) * nearness(oval.centre);
        point.distance(project(oval.centre)) < radius + pixel_cm
    });
    let blades = body.leaves.iter().filter_map(|leaf| blade_depth(leaf, point));
    nodes
        .map(|node| node.at[2] + node.radius)
        .chain(ovals.map(|oval| oval.centre[2]))
        .chain(blades)
        .reduce(f64::max)
}

fn covers(node: &Node, point: Point, pixel_cm: f64) -> bool {
    point.distance(project(node.at)) < node.radius * nearness(node.at) + 1.5 * pixel_cm
}

/// z of a leaf's blade at a point of the picture: of its plane, within its extent.
fn blade_depth(leaf: &Blade, point: Point) -> Option<f64> {
    let centre = leaf.centre();
    let edge = leaf.halves.iter().flatten().map(|&place| project(place));
    let (mut low, mut high) = (project(centre), project(centre));
    for place in edge {
        low = Point::new(low.x.min(place.x), low.y.min(place.y));
        high = Point::new(high.x.max(place.x), high.y.max(place.y));
    }
    let is_within = (low.x..=high.x).contains(&point.x) && (low.y..=high.y).contains(&point.y);
    let normal = add(leaf.normals[0], leaf.normals[1]);
    let along = sub([point.x, point.y, 0.0], CAMERA);
    let slope = dot(along, normal);
    let seen = dot(sub(centre, CAMERA), normal) / slope;
    let reach = dot(sub(leaf.midrib[1], leaf.midrib[0]), sub(leaf.midrib[1], leaf.midrib[0])).sqrt();
    is_within.then(|| {
        let z = CAMERA[2] + seen * along[2];
        // A blade seen on its edge.
        if z.is_finite() { z.clamp(centre[2] - 0.5 * reach, centre[2] + 0.5 * reach) } else { centre[2] }
    })
}
