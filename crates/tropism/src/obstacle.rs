//! Obstacles: discs, boxes and lines in the plane of the plant, and poles and bars in space.
//!
//! A task has obstacles in its plane, which a stem must not touch. The virtual tent also has poles and bars, on which a stem
//! leans.
//! Distances are signed: above 0 outside, below 0 inside.
//!
//! # References
//! Hart 1996, doi:10.1007/s003710050084 (signed distances; how far a line can be followed without meeting anything).

use serde::{Deserialize, Serialize};

use crate::check::{OutOfRange, ensure};
use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, Polyline};
use crate::math::vector::{cross, dot, norm, normalize_or, scale, sub};
use crate::math::{self, Mask, Real};

/// One obstacle.
///
/// ```
/// use tropism::geometry::Point;
/// use tropism::obstacle::Obstacle;
/// let disc: Obstacle = serde_json::from_str(r#"{"disc": [0, 8], "radius_cm": 1}"#)?;
/// assert_eq!(disc.distance(Point::new(3.0, 8.0)), 2.0);
/// let bar: Obstacle = serde_json::from_str(r#"{"line": [[0, 6.5], [8, 6.5]]}"#)?;
/// assert_eq!(bar.distance(Point::new(4.0, 5.0)), 1.5);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Keys", into = "Keys")]
pub enum Obstacle {
    /// A disc, such as a rod seen from its end.
    Disc {
        /// Its centre, in cm.
        centre: Point,
        /// Its radius, in cm.
        radius_cm: f64,
    },
    /// A box with sides along x and y.
    Box {
        /// Two opposite corners, in cm.
        corners: [Point; 2],
    },
    /// A thin straight bar.
    Line {
        /// Its ends, in cm.
        ends: [Point; 2],
    },
}

/// An upright round pole that stands in the soil.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Pole {
    /// Its axis: x to the right, z towards the camera, from the base of the plant, in cm.
    pub at: [f64; 2],
    /// Its radius, in cm.
    pub radius_cm: f64,
    /// Its height above the soil, in cm; infinite for a pole that leaves the tent.
    pub height_cm: f64,
}

/// A straight round bar in space with rounded ends, such as a support that leans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// The ends of its axis, in cm.
    pub ends: [SpacePoint; 2],
    /// Its radius, in cm.
    pub radius_cm: f64,
}

/// A solid thing in the tent, through which no stem passes.
///
/// ```
/// use tropism::obstacle::{Pole, Solid};
/// let pole: Solid = serde_json::from_str(r#"{"pole": [2, 0], "radius_cm": 0.4, "height_cm": 30}"#)?;
/// assert_eq!(pole, Solid::Pole(Pole { at: [2.0, 0.0], radius_cm: 0.4, height_cm: 30.0 }));
/// let disc: Solid = serde_json::from_str(r#"{"disc": [0, 8], "radius_cm": 1}"#)?;
/// assert!(matches!(disc, Solid::Plane(_)));
/// let bar: Solid = serde_json::from_str(r#"{"bar": [[2, 0, 0], [30, 28, 0]], "radius_cm": 0.4}"#)?;
/// assert!(matches!(bar, Solid::Bar(_)));
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Keys", into = "Keys")]
pub enum Solid {
    /// An obstacle of the plane: a rod or a sheet that points at the front camera, so that the camera sees its end.
    Plane(Obstacle),
    /// A pole.
    Pole(Pole),
    /// A bar.
    Bar(Bar),
}

/// The keys of all kinds, so that a wrong one is reported by name.
#[derive(Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Centre of a disc, such as a rod seen from its end, in cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    disc: Option<Point>,
    /// Axis of an upright pole, in cm: x to the right, z towards the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pole: Option<[f64; 2]>,
    /// Ends of the axis of a round bar in space, in cm: x to the right, y up, z towards the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bar: Option<[SpacePoint; 2]>,
    /// Radius of the disc, the pole or the bar, in cm above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius_cm: Option<f64>,
    /// Two opposite corners of a box with sides along x and y, in cm.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    corners: Option<[Point; 2]>,
    /// Ends of a thin straight bar, in cm.
    #[serde(default, rename = "line", skip_serializing_if = "Option::is_none")]
    ends: Option<[Point; 2]>,
    /// Height of the pole, in cm; without it the pole leaves the tent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height_cm: Option<f64>,
}

impl TryFrom<Keys> for Obstacle {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, &'static str> {
        match keys {
            Keys { pole: Some(_), .. } | Keys { bar: Some(_), .. } | Keys { height_cm: Some(_), .. } => Err(
                "an obstacle of a task lies in its plane, and poles and bars do not: wanted disc, box or line",
            ),
            Keys { disc: Some(centre), radius_cm: Some(radius_cm), corners: None, ends: None, .. } => {
                Ok(Self::Disc { centre, radius_cm })
            }
            Keys { disc: None, radius_cm: None, corners: Some(corners), ends: None, .. } => {
                Ok(Self::Box { corners })
            }
            Keys { disc: None, radius_cm: None, corners: None, ends: Some(ends), .. } => {
                Ok(Self::Line { ends })
            }
            _ => Err("an obstacle is { disc = [x, y], radius_cm = r }, { box = [[x, y], [x, y]] } or \
                      { line = [[x, y], [x, y]] }"),
        }
    }
}

impl TryFrom<Keys> for Solid {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, &'static str> {
        match keys {
            Keys { pole: None, bar: None, .. } => Obstacle::try_from(keys).map(Self::Plane),
            Keys {
                pole: Some(at),
                bar: None,
                radius_cm: Some(radius_cm),
                height_cm,
                disc: None,
                corners: None,
                ends: None,
            } => Ok(Self::Pole(Pole { at, radius_cm, height_cm: height_cm.unwrap_or(f64::INFINITY) })),
            Keys {
                pole: None,
                bar: Some(ends_of_axis),
                radius_cm: Some(radius_cm),
                height_cm: None,
                disc: None,
                corners: None,
                ends: None,
            } => Ok(Self::Bar(Bar { ends: ends_of_axis, radius_cm })),
            Keys { bar: None, .. } => Err(
                "a pole is { pole = [x, z], radius_cm = r, height_cm = h }; without a height it leaves the tent",
            ),
            _ => Err("a bar is { bar = [[x, y, z], [x, y, z]], radius_cm = r }"),
        }
    }
}

impl From<Solid> for Keys {
    fn from(solid: Solid) -> Self {
        match solid {
            Solid::Plane(obstacle) => obstacle.into(),
            Solid::Pole(Pole { at, radius_cm, height_cm }) => Self {
                pole: Some(at),
                radius_cm: Some(radius_cm),
                height_cm: Some(height_cm).filter(|height| height.is_finite()),
                ..Self::default()
            },
            Solid::Bar(Bar { ends, radius_cm }) => {
                Self { bar: Some(ends), radius_cm: Some(radius_cm), ..Self::default() }
            }
        }
    }
}

impl From<Obstacle> for Solid {
    fn from(obstacle: Obstacle) -> Self {
        Self::Plane(obstacle)
    }
}

impl From<Pole> for Solid {
    fn from(pole: Pole) -> Self {
        Self::Pole(pole)
    }
}

impl From<Bar> for Solid {
    fn from(bar: Bar) -> Self {
        Self::Bar(bar)
    }
}

impl Pole {
    /// Horizontal distance of a point from the surface of the pole, in cm; below 0 inside. Its end is not looked at.
    #[must_use]
    pub fn distance(&self, point: SpacePoint) -> f64 {
        math::hypot(point[0] - self.at[0], point[2] - self.at[1]) - self.radius_cm
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { at, radius_cm, height_cm } = *self;
        ensure(at.iter().all(|axis| axis.is_finite()), "pole", format!("{at:?}"), "finite numbers of cm")?;
        ensure(radius_cm > 0.0 && radius_cm.is_finite(), "radius_cm", radius_cm, "cm above 0")?;
        ensure(height_cm > 0.0, "height_cm", height_cm, "cm above 0")
    }
}

impl Bar {
    /// Distance of a place from the surface of the bar, in cm, below 0 inside, and the direction from the axis to it.
    ///
    /// ```
    /// use tropism::obstacle::Bar;
    /// let bar = Bar { ends: [[0.0, 0.0, 0.0], [10.0, 10.0, 0.0]], radius_cm: 0.5 };
    /// assert_eq!(bar.distance_and_normal([5.0, 5.0, 2.0]), (1.5, [0.0, 0.0, 1.0]));
    /// ```
    #[must_use]
    pub fn distance_and_normal(&self, place: SpacePoint) -> (f64, SpacePoint) {
        let [from, to] = self.ends;
        let (axis, way) = (sub(to, from), sub(place, from));
        let share = (dot(way, axis) / dot(axis, axis)).clamp(0.0, 1.0);
        let away = sub(way, scale(axis, share));
        (norm(away) - self.radius_cm, normalize_or(away, self.across()[0]))
    }

    /// Two directions across the axis; with that from the first end to the second they are right-handed.
    #[must_use]
    pub fn across(&self) -> [SpacePoint; 2] {
        let along = normalize_or(sub(self.ends[1], self.ends[0]), [0.0, 1.0, 0.0]);
        // The axis of space that is farthest from that of the bar.
        let other = if along[0].abs() < 0.8 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let first = normalize_or(sub(other, scale(along, dot(other, along))), other);
        [first, cross(along, first)]
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { ends, radius_cm } = *self;
        let is_long = norm(sub(ends[1], ends[0])) > 0.0;
        let is_finite = ends.iter().flatten().all(|value| value.is_finite());
        ensure(is_finite && is_long, "bar", format!("{ends:?}"), "two places in cm")?;
        ensure(radius_cm > 0.0 && radius_cm.is_finite(), "radius_cm", radius_cm, "cm above 0")
    }
}

impl Solid {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Plane(obstacle) => obstacle.check(),
            Self::Pole(pole) => pole.check(),
            Self::Bar(bar) => bar.check(),
        }
    }

    /// The same solid in a mirror: x changes sign.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Plane(obstacle) => Self::Plane(obstacle.mirrored()),
            Self::Pole(Pole { at: [x, z], radius_cm, height_cm }) => {
                Self::Pole(Pole { at: [-x, z], radius_cm, height_cm })
            }
            Self::Bar(Bar { ends, radius_cm }) => {
                Self::Bar(Bar { ends: ends.map(|[x, y, z]| [-x, y, z]), radius_cm })
            }
        }
    }
}

impl From<Obstacle> for Keys {
    fn from(obstacle: Obstacle) -> Self {
        let none = Self::default();
        match obstacle {
            Obstacle::Disc { centre, radius_cm } => {
                Self { disc: Some(centre), radius_cm: Some(radius_cm), ..none }
            }
            Obstacle::Box { corners } => Self { corners: Some(corners), ..none },
            Obstacle::Line { ends } => Self { ends: Some(ends), ..none },
        }
    }
}

/// x and y, in cm.
pub(crate) type Place<R> = [R; 2];

/// Where a stem is nearest to obstacles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance<R = f64> {
    /// Distance from the midline of the stem to the obstacle, in cm; below 0 if it passes through.
    pub distance_cm: R,
    /// x and y of the point of the stem, in cm.
    pub stem: [R; 2],
    /// x and y of the point of the obstacle that it keeps away from, in cm: of a disc the centre, of a box or a line the nearest
    /// one.
    pub obstacle: [R; 2],
}

impl Obstacle {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let are_finite = |key, points: [Point; 2]| {
            let found = format!("{:?}", points.map(<[f64; 2]>::from));
            ensure(points.iter().all(|point| point.is_finite()), key, found, "finite numbers of cm")
        };
        match *self {
            Self::Disc { centre, radius_cm } => {
                are_finite("disc", [centre; 2])?;
                ensure(radius_cm > 0.0 && radius_cm.is_finite(), "radius_cm", radius_cm, "cm above 0")
            }
            Self::Box { corners } => are_finite("box", corners),
            Self::Line { ends } => are_finite("line", ends),
        }
    }

    /// The lower left and the upper right corner of the rectangle that holds it, in cm.
    #[must_use]
    pub fn extent(&self) -> (Point, Point) {
        let (points, by) = match *self {
            Self::Disc { centre, radius_cm } => ([centre; 2], radius_cm),
            Self::Box { corners: points } | Self::Line { ends: points } => (points, 0.0),
        };
        let [one, other] = points;
        (
            Point::new(one.x.min(other.x) - by, one.y.min(other.y) - by),
            Point::new(one.x.max(other.x) + by, one.y.max(other.y) + by),
        )
    }

    /// The same obstacle in a mirror: x changes sign.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Disc { centre, radius_cm } => Self::Disc { centre: centre.mirrored(), radius_cm },
            Self::Box { corners } => Self::Box { corners: corners.map(Point::mirrored) },
            Self::Line { ends } => Self::Line { ends: ends.map(Point::mirrored) },
        }
    }

    /// Distance from `point` to the obstacle, in cm; below 0 inside.
    #[must_use]
    pub fn distance(&self, point: Point) -> f64 {
        self.distance_from(point.into())
    }

    /// [`Self::distance`], of as many places as a number has lanes.
    #[inline(always)]
    fn distance_from<R: Real>(&self, at: Place<R>) -> R {
        match *self {
            Self::Disc { radius_cm, .. } => apart(at, self.nearest(at)) - radius_cm,
            Self::Line { .. } => apart(at, self.nearest(at)),
            Self::Box { corners } => {
                // How far outside of each pair of sides; below 0 between them.
                let [low, high] = bounds(corners);
                let [x, y] = [0, 1].map(|axis| (-at[axis] + low[axis]).max(at[axis] - high[axis]));
                let (nothing, most) = (R::splat(0.0), x.max(y));
                R::select(most.lt(nothing), most, math::hypot(x.max(nothing), y.max(nothing)))
            }
        }
    }

    /// Distance from `point` to the obstacle, as [`Self::distance`] to 1e-12 cm, and the direction in which it grows.
    #[must_use]
    pub fn distance_and_normal(&self, point: Point) -> (f64, [f64; 2]) {
        if let Self::Box { corners: [one, other] } = *self {
            // Inside, the nearest side decides.
            let outside = |value: f64, a: f64, b: f64| {
                let (low, high) = (a.min(b) - value, value - a.max(b));
                if low > high { (low, -1.0) } else { (high, 1.0) }
            };
            let ((x, left), (y, down)) = (outside(point.x, one.x, other.x), outside(point.y, one.y, other.y));
            if x.max(y) < 0.0 {
                return if x > y { (x, [left, 0.0]) } else { (y, [0.0, down]) };
            }
        }
        let radius = if let Self::Disc { radius_cm, .. } = *self { radius_cm } else { 0.0 };
        let away = math::vector::sub(point.into(), self.nearest(point.into()));
        let length = math::vector::norm(away);
        let normal = if length > 0.0 {
            away.map(|axis| axis / length)
        } else if let Self::Line { ends: [from, to] } = *self {
            // On the line itself either side will do.
            math::vector::normalize_or([to.y - from.y, from.x - to.x], [0.0, 1.0])
        } else {
            [0.0, 1.0]
        };
        (length - radius, normal)
    }

    /// The point from which a stem at a place keeps away: see [`Clearance::obstacle`].
    #[inline(always)]
    fn nearest<R: Real>(&self, at: Place<R>) -> Place<R> {
        match *self {
            Self::Disc { centre, .. } => place(centre),
            Self::Box { corners } => {
                let [low, high] = bounds(corners).map(|corner| corner.map(R::splat));
                [0, 1].map(|axis| at[axis].clamp(low[axis], high[axis]))
            }
            Self::Line { ends } => {
                let way = ends.map(place);
                between(way, share_nearest(way, at))
            }
        }
    }

    /// Shares of a way among which that of the point nearest to the obstacle is, and their number.
    #[inline(always)]
    fn shares_nearest<R: Real>(&self, way: [Place<R>; 2]) -> ([R; MOST_SHARES], usize) {
        let mut shares = [R::splat(0.0); MOST_SHARES];
        match *self {
            Self::Disc { centre, .. } => {
                shares[0] = share_nearest(way, place(centre));
                (shares, 1)
            }
            // Two straight lines are nearest to each other at an end of one of them, or where they cross.
            Self::Line { ends } => {
                let [first, last] = ends.map(|end| share_nearest(way, place(end)));
                shares[1..5].copy_from_slice(&[R::splat(1.0), first, last, share_crossing(way, ends)]);
                (shares, 5)
            }
            // Outside, a way is nearest at one of its ends or to a corner. Inside, it is deepest where two sides are equally far.
            Self::Box { corners } => {
                let [[left, low], [right, high]] = bounds(corners);
                shares[1] = R::splat(1.0);
                let corners = [[left, low], [right, low], [right, high], [left, high]];
                for (share, corner) in shares[2..6].iter_mut().zip(corners) {
                    *share = share_nearest(way, corner.map(R::splat));
                }
                // The distance from each side, inside: a x + b y + c.
                let sides = [[-1.0, 0.0, left], [1.0, 0.0, -right], [0.0, -1.0, low], [0.0, 1.0, -high]];
                let pairs = [[0, 1], [2, 3], [0, 2], [0, 3], [1, 2], [1, 3]];
                for (share, [one, other]) in shares[6..].iter_mut().zip(pairs) {
                    let [a, b, c] = [0, 1, 2].map(|part| sides[one][part] - sides[other][part]);
                    *share = share_where_zero(way.map(|[x, y]| x * a + y * b + c));
                }
                (shares, MOST_SHARES)
            }
        }
    }
}

/// Most shares that [`Obstacle::shares_nearest`] gives: those of a box, two ends, four corners and six pairs of sides.
const MOST_SHARES: usize = 12;

#[inline(always)]
fn place<R: Real>(point: Point) -> Place<R> {
    [R::splat(point.x), R::splat(point.y)]
}

/// The lower left and the upper right corner of a box.
fn bounds([one, other]: [Point; 2]) -> [Place<f64>; 2] {
    [[one.x.min(other.x), one.y.min(other.y)], [one.x.max(other.x), one.y.max(other.y)]]
}

#[inline(always)]
fn apart<R: Real>(one: Place<R>, other: Place<R>) -> R {
    math::hypot(one[0] - other[0], one[1] - other[1])
}

#[inline(always)]
fn between<R: Real>([from, to]: [Place<R>; 2], share: R) -> Place<R> {
    [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}

/// The share of a way at which it is nearest to a place; 0 where both ends are one.
#[inline(always)]
fn share_nearest<R: Real>([from, to]: [Place<R>; 2], at: Place<R>) -> R {
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let square = x * x + y * y;
    let along = (at[0] - from[0]) * x + (at[1] - from[1]) * y;
    let nothing = R::splat(0.0);
    R::select(square.gt(nothing), (along / square).clamp(nothing, R::splat(1.0)), nothing)
}

/// The share of a way on which a linear function with these values at its ends is 0, on the way or beyond it; not finite where the
/// function is constant.
#[inline(always)]
fn share_where_zero<R: Real>([before, after]: [R; 2]) -> R {
    before / (before - after)
}

/// The share of a way at which it crosses the straight line through `ends`, on the way or beyond it; not finite if they are
/// parallel.
#[inline(always)]
pub(crate) fn share_crossing<R: Real>(way: [Place<R>; 2], ends: [Point; 2]) -> R {
    let [x, y] = [ends[1].x - ends[0].x, ends[1].y - ends[0].y];
    share_where_zero(way.map(|at| (at[1] - ends[0].y) * x - (at[0] - ends[0].x) * y))
}

/// Bound of the rounding error of a distance, in cm. Chosen: far above the spacing of `f64` at 100 cm, 1.4e-14.
const ROUNDING_CM: f64 = 1e-9;

/// Where `stem` is nearest to any of `obstacles`; `None` without obstacles, or without a stem of two points.
#[must_use]
pub fn clearance(obstacles: &[Obstacle], stem: &Polyline) -> Option<Clearance> {
    clearance_within(f64::INFINITY, obstacles, stem)
}

/// As [`clearance`]; `None`, too, where no part of the stem is nearer than `limit_cm`, which is found sooner.
pub(crate) fn clearance_within(limit_cm: f64, obstacles: &[Obstacle], stem: &Polyline) -> Option<Clearance> {
    let places = stem.0.iter().map(|&point| place(point));
    Some(clearance_of(limit_cm, obstacles, places)).filter(|nearest| nearest.distance_cm < limit_cm)
}

/// Where stems through `places`, as many as a number has lanes, are nearest to any of `obstacles`. Where no part of a stem is
/// nearer than `limit_cm`, this is the distance.
#[inline(always)]
pub(crate) fn clearance_of<R: Real>(
    limit_cm: f64,
    obstacles: &[Obstacle],
    places: impl IntoIterator<Item = Place<R>>,
) -> Clearance<R> {
    let nowhere = [R::splat(0.0); 2];
    let mut nearest = Clearance { distance_cm: R::splat(limit_cm), stem: nowhere, obstacle: nowhere };
    let mut places = places.into_iter();
    let Some(mut from) = places.next() else { return nearest };
    for to in places {
        let way = [from, to];
        let (middle, half) = (between(way, R::splat(0.5)), apart(from, to) * 0.5);
        for obstacle in obstacles {
            // No point of the segment is nearer than its middle by more than half its length.
            let bound = obstacle.distance_from(middle) - half;
            if !bound.lt(nearest.distance_cm + ROUNDING_CM).any() {
                continue;
            }
            let (shares, count) = obstacle.shares_nearest(way);
            for share in &shares[..count] {
                // A share that is not a number gives no place, which is never nearer.
                let share = share.clamp(R::splat(0.0), R::splat(1.0));
                nearest.look(obstacle, between(way, share));
            }
        }
        from = to;
    }
    nearest
}

impl<R: Real> Clearance<R> {
    /// Takes a place of the stem where it is nearer.
    #[inline(always)]
    fn look(&mut self, obstacle: &Obstacle, at: Place<R>) {
        let distance_cm = obstacle.distance_from(at);
        let is_nearer = distance_cm.lt(self.distance_cm);
        let from = obstacle.nearest(at);
        self.distance_cm = R::select(is_nearer, distance_cm, self.distance_cm);
        for axis in 0..2 {
            self.stem[axis] = R::select(is_nearer, at[axis], self.stem[axis]);
            self.obstacle[axis] = R::select(is_nearer, from[axis], self.obstacle[axis]);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point> {
        (-8.0..8.0, 0.0..15.0).prop_map(|(x, y)| Point::new(x, y))
    }

    fn obstacle() -> impl Strategy<Value = Obstacle> {
        prop_oneof![
            (point(), 0.1..3.0).prop_map(|(centre, radius_cm)| Obstacle::Disc { centre, radius_cm }),
            [point(), point()].prop_map(|corners| Obstacle::Box { corners }),
            [point(), point()].prop_map(|ends| Obstacle::Line { ends }),
        ]
    }

    #[test]
    fn inside_of_a_box_the_distance_is_negative() {
        let shape = Obstacle::Box { corners: [Point::new(2.0, 7.0), Point::new(0.0, 6.0)] };
        assert_eq!(shape.distance(Point::new(1.0, 6.25)), -0.25);
        assert_eq!(shape.distance(Point::new(5.0, 11.0)), 5.0);
        shape.check().unwrap();
    }

    #[test]
    fn flat_obstacles_are_refused() {
        let pole = Pole { at: [1.0, -2.0], radius_cm: 0.3, height_cm: 0.0 };
        let error = Solid::Pole(pole).check().unwrap_err().to_string();
        assert_eq!(error, "found height_cm = 0, wanted cm above 0");
        let bar = Bar { ends: [[1.0, 2.0, 3.0]; 2], radius_cm: 0.4 };
        let error = Solid::Bar(bar).check().unwrap_err().to_string();
        assert_eq!(error, "found bar = [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]], wanted two places in cm");
        let flat = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 0.0 };
        assert_eq!(flat.check().unwrap_err().to_string(), "found radius_cm = 0, wanted cm above 0");
    }

    proptest! {
        #[test]
        fn an_upright_bar_is_as_far_as_a_pole(
            [x, z] in [-5.0..5.0, -5.0..5.0], place in [-8.0..8.0, 0.0..30.0, -8.0..8.0],
        ) {
            let pole = Pole { at: [x, z], radius_cm: 0.5, height_cm: 30.0 };
            let bar = Bar { ends: [[x, 0.0, z], [x, 30.0, z]], radius_cm: 0.5 };
            prop_assert!((bar.distance_and_normal(place).0 - pole.distance(place)).abs() < 1e-9);
            let [first, second] = bar.across();
            prop_assert!(norm(sub(cross(first, second), [0.0, 1.0, 0.0])) < 1e-12);
        }

        #[test]
        fn the_distance_grows_along_the_normal(obstacle in obstacle(), point in point()) {
            let (distance, [x, y]) = obstacle.distance_and_normal(point);
            prop_assert!((distance - obstacle.distance(point)).abs() < 1e-12);
            prop_assert!((math::hypot(x, y) - 1.0).abs() < 1e-12);
            let ahead = Point::new(point.x + 1e-6 * x, point.y + 1e-6 * y);
            prop_assert!((obstacle.distance(ahead) - distance - 1e-6).abs() < 1e-9);
        }

        #[test]
        fn the_distance_grows_no_faster_than_one_moves(
            obstacle in obstacle(), from in point(), to in point(),
        ) {
            let change = (obstacle.distance(from) - obstacle.distance(to)).abs();
            prop_assert!(change <= from.distance(to) + 1e-9);
            prop_assert_eq!(obstacle.mirrored().distance(from.mirrored()), obstacle.distance(from));
        }

        #[test]
        fn the_clearance_is_the_least_distance(
            obstacles in prop::collection::vec(obstacle(), 1..4),
            stem in prop::collection::vec(point(), 2..8),
        ) {
            let found = clearance(&obstacles, &Polyline(stem.clone())).unwrap();
            for pair in stem.windows(2) {
                for share in 0..=1000 {
                    let point = pair[0].lerp(pair[1], f64::from(share) / 1000.0);
                    for obstacle in &obstacles {
                        prop_assert!(obstacle.distance(point) > found.distance_cm - 1e-9);
                    }
                }
            }
        }

        #[test]
        fn a_limit_changes_no_nearer_clearance(
            obstacles in prop::collection::vec(obstacle(), 1..4),
            stem in prop::collection::vec(point(), 2..8),
            limit_cm in -1.0..6.0,
        ) {
            let stem = Polyline(stem);
            let wanted = clearance(&obstacles, &stem).filter(|nearest| nearest.distance_cm < limit_cm);
            prop_assert_eq!(clearance_within(limit_cm, &obstacles, &stem), wanted);
        }
    }
}
