//! Programmes: when a controller may steer in the course of a day, and which lamps shine besides.
//!
//! In come the `[[programme]]` tables of a rig file and the local time of day; out comes what [acts](Acting): whether the
//! decision of the controller is lit, and the levels of a base light. Outside of all parts it is night: nothing is lit.
//! Without a programme a controller steers day and night.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::lamps::{DARK, Layout};
use crate::lighting::{Allowed, FULL, Lighting, LightingError, NotAllowed};

/// Minutes of a day.
const DAY: u16 = 24 * 60;

/// A time of day on the clock on the wall, to the minute: 00:00 to 24:00, the end of the day.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TimeOfDay(u16);

impl TimeOfDay {
    /// The beginning of a day.
    pub const MIDNIGHT: Self = Self(0);

    /// The time `hour`:`minute`.
    ///
    /// # Panics
    /// After 24:00, and for more than 59 minutes.
    #[must_use]
    pub const fn new(hour: u16, minute: u16) -> Self {
        assert!(minute < 60 && hour * 60 + minute <= DAY, "a time of day");
        Self(hour * 60 + minute)
    }

    /// The time so many minutes later, on whatever day.
    #[must_use]
    pub const fn later(self, minutes: u64) -> Self {
        Self(((self.0 as u64 + minutes) % DAY as u64) as u16)
    }

    /// Minutes from `earlier` to this time, less than a day.
    const fn since(self, earlier: Self) -> u16 {
        (self.0 + DAY - earlier.0 % DAY) % DAY
    }
}

impl fmt::Display for TimeOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02}:{:02}", self.0 / 60, self.0 % 60)
    }
}

impl FromStr for TimeOfDay {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let part = |digits: &str| {
            let is_plain = digits.len() == 2 && digits.bytes().all(|byte| byte.is_ascii_digit());
            is_plain.then(|| digits.parse::<u16>().ok()).flatten()
        };
        let time = word.split_once(':').and_then(|(hour, minute)| Some((part(hour)?, part(minute)?)));
        time.filter(|(hour, minute)| *minute < 60 && hour * 60 + minute <= DAY)
            .map(|(hour, minute)| Self::new(hour, minute))
            .ok_or_else(|| format!("found the time {word:?}, wanted \"00:00\" to \"24:00\""))
    }
}

impl Serialize for TimeOfDay {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for TimeOfDay {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        std::borrow::Cow::<str>::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// A part of a day: a table `[[programme]]` of a rig file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Local time at which it begins, such as `"06:00"`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub from: TimeOfDay,
    /// Local time at which it ends, such as `"22:00"`; of the next day if it is earlier than `from`. `"24:00"` is the end of the
    /// day.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub to: TimeOfDay,
    /// Whether the decisions of the controller are lit.
    #[serde(default = "yes")]
    pub steer: bool,
    /// Lamps that shine besides, or alone if the part does not steer: lamps with levels such as `"top:64+front"`, or none,
    /// `"dark"`, if it is left out. A lamp that is steered, too, has the higher level.
    #[serde(default = "dark", skip_serializing_if = "is_dark")]
    pub base: String,
    /// Minutes in which the base light rises after `from` and falls before `to`: from and to the level that a lamp has in the
    /// adjoining part, where that is lower. At most half of the part; 0 if it is left out.
    #[serde(default, skip_serializing_if = "is_none")]
    pub ramp_min: u16,
}

const fn yes() -> bool {
    true
}

fn dark() -> String {
    DARK.to_owned()
}

fn is_dark(base: &str) -> bool {
    base == DARK
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde asks")]
const fn is_none(minutes: &u16) -> bool {
    *minutes == 0
}

impl Part {
    /// Its minutes; 0 if it ends when it begins.
    fn minutes(&self) -> u16 {
        let is_whole_day = self.from == TimeOfDay::MIDNIGHT && self.to == TimeOfDay(DAY);
        if is_whole_day { DAY } else { self.to.since(self.from) }
    }

    /// Minutes since it began; `None` if it does not act at `time`.
    fn elapsed(&self, time: TimeOfDay) -> Option<u16> {
        Some(time.since(self.from)).filter(|&elapsed| elapsed < self.minutes())
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.elapsed(other.from).is_some() || other.elapsed(self.from).is_some()
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", self.from, self.to)
    }
}

/// What is wrong with a part of a programme.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("programme {number}: {problem}")]
pub struct ProgrammeError {
    /// Number of the part in its file, from 1.
    pub number: usize,
    /// The problem.
    pub problem: PartProblem,
}

/// Why a part of a programme cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PartProblem {
    /// It has no length.
    #[error(
        "found from and to both {0}, wanted two times; the whole day is from = \"00:00\", to = \"24:00\""
    )]
    Empty(TimeOfDay),
    /// Two parts act at once.
    #[error("found {0}, wanted no time of programme {1}, {2}: let each begin where the other ends")]
    Overlap(String, usize, String),
    /// The base light names no lamps.
    #[error("base: {0}")]
    Base(#[from] LightingError),
    /// A ramp that is too long.
    #[error("found ramp_min = {found}, wanted at most half of the part, {most}")]
    Ramp {
        /// Minutes.
        found: u16,
        /// Half of the part, in minutes.
        most: u16,
    },
    /// A ramp of nothing.
    #[error("found ramp_min = {0} without a base light, wanted base, or no ramp")]
    RampOfNothing(u16),
    /// A base light, or it with a lamp that is steered, which the rig does not allow.
    #[error("base = \"{base}\"{steered}: {source}; lower the base, set steer = false, or raise `allowed`")]
    NotAllowed {
        /// The base light.
        base: String,
        /// The lamp that is steered with it, in words.
        steered: String,
        /// Which limit is exceeded.
        source: NotAllowed,
    },
    /// A ramp where lamps have no levels.
    #[error("found ramp_min = {0}, wanted `allowed = {{ any = … }}` of lamps that have levels, or no ramp")]
    RampWithoutLevels(u16),
}

/// What acts of a programme at a time of day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acting {
    /// Number of the part in its file, from 1; 0 outside of all parts.
    pub part: u32,
    /// Whether the decision of the controller is lit.
    pub is_steered: bool,
    /// The base light.
    pub base: Lighting,
}

impl Acting {
    /// Outside of all parts.
    const NIGHT: Self = Self { part: 0, is_steered: false, base: Lighting::DARK };

    /// The lighting that `decided` becomes: of each lamp the higher level of decision and base light, or the base light alone.
    #[must_use]
    pub fn lighting(self, decided: Lighting) -> Lighting {
        if self.is_steered { decided.zip(self.base, u8::max) } else { self.base }
    }
}

/// A checked programme of a rig.
///
/// ```
/// use tropism::lamps::{Layout, Light};
/// use tropism::lighting::{Allowed, Lighting};
/// use tropism::programme::{Part, Programme, TimeOfDay};
/// let day = Part { from: TimeOfDay::new(6, 0), to: TimeOfDay::new(22, 0), steer: true, base: "dark".into(), ramp_min: 0 };
/// let programme = Programme::new(&[day], &Layout::wahby2016(), Allowed::One).unwrap();
/// let right = Lighting::only(Light::RIGHT);
/// assert_eq!(programme.at(TimeOfDay::new(12, 0)).lighting(right), right);
/// assert_eq!(programme.at(TimeOfDay::new(23, 0)).lighting(right), Lighting::DARK);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Programme {
    parts: Vec<CheckedPart>,
}

/// A part with its base light, and the levels at which its ramps begin and end.
#[derive(Clone, Debug, PartialEq)]
struct CheckedPart {
    part: Part,
    base: Lighting,
    /// After `from` and before `to`.
    ends: [Lighting; 2],
}

impl CheckedPart {
    /// The base light `elapsed` minutes after the beginning.
    fn base_after(&self, elapsed: u16) -> Lighting {
        let (left, ramp) = (self.part.minutes() - elapsed, self.part.ramp_min);
        let (far, end) = if elapsed <= left { (elapsed, self.ends[0]) } else { (left, self.ends[1]) };
        if far >= ramp {
            return self.base;
        }
        let (far, ramp) = (u32::from(far), u32::from(ramp));
        self.base.zip(end, |base, end| end + ((u32::from(base - end) * far + ramp / 2) / ramp) as u8)
    }
}

impl Programme {
    /// The programme of `parts` for the lamps of `layout`, of which as many may shine as `allowed` says.
    ///
    /// # Errors
    /// The first [`ProgrammeError`]: a part without a length, parts that overlap, a base light of lamps that are not there,
    /// or one that with any steered lamp exceeds what is allowed.
    pub fn new(parts: &[Part], layout: &Layout, allowed: Allowed) -> Result<Self, ProgrammeError> {
        let checked = |(index, part): (usize, &Part)| {
            let before = parts[..index].iter().enumerate();
            check(part, before, layout, allowed)
                .map_err(|problem| ProgrammeError { number: index + 1, problem })
        };
        let bases = parts.iter().enumerate().map(checked).collect::<Result<Vec<_>, _>>()?;
        let adjoining = |meets: &dyn Fn(&Part) -> bool| {
            parts.iter().zip(&bases).find(|(part, _)| meets(part)).map_or(Lighting::DARK, |(_, base)| *base)
        };
        let is_same = |one: TimeOfDay, other: TimeOfDay| one.since(other) == 0;
        let part = |(part, &base): (&Part, &Lighting)| {
            let before = adjoining(&|other| is_same(other.to, part.from));
            let after = adjoining(&|other| is_same(other.from, part.to));
            CheckedPart { part: part.clone(), base, ends: [before, after].map(|end| base.zip(end, u8::min)) }
        };
        Ok(Self { parts: parts.iter().zip(&bases).map(part).collect() })
    }

    /// What acts at the local time `time`.
    #[must_use]
    pub fn at(&self, time: TimeOfDay) -> Acting {
        let acting = (1..).zip(&self.parts).find_map(|(number, checked)| {
            let elapsed = checked.part.elapsed(time)?;
            Some(Acting { part: number, is_steered: checked.part.steer, base: checked.base_after(elapsed) })
        });
        acting.unwrap_or(Acting::NIGHT)
    }

    /// The lamps whose base light needs levels between dark and full power, at least for a time.
    #[must_use]
    pub fn dimmed(&self) -> Lighting {
        self.parts.iter().fold(Lighting::DARK, |all, CheckedPart { part, base, ends }| {
            let ends = if part.ramp_min > 0 { *ends } else { [*base; 2] };
            ends.into_iter().fold(all, |all, end| {
                let is_dimmed = base.zip(end, |base, end| if base == end && base == FULL { 0 } else { base });
                all.zip(is_dimmed, u8::max)
            })
        })
    }
}

/// Checks `part` by itself and against those `before` it, and reads its base light.
fn check<'p>(
    part: &Part,
    mut before: impl Iterator<Item = (usize, &'p Part)>,
    layout: &Layout,
    allowed: Allowed,
) -> Result<Lighting, PartProblem> {
    if part.minutes() == 0 {
        return Err(PartProblem::Empty(part.from));
    }
    if let Some((index, other)) = before.find(|(_, other)| part.overlaps(other)) {
        return Err(PartProblem::Overlap(part.to_string(), index + 1, other.to_string()));
    }
    let base = Lighting::parse(&part.base, layout)?;
    let most = part.minutes() / 2;
    if part.ramp_min > most {
        return Err(PartProblem::Ramp { found: part.ramp_min, most });
    }
    if part.ramp_min > 0 && base == Lighting::DARK {
        return Err(PartProblem::RampOfNothing(part.ramp_min));
    }
    let not_allowed =
        |steered: String| |source| PartProblem::NotAllowed { base: part.base.clone(), steered, source };
    allowed.permit(base).map_err(not_allowed(String::new()))?;
    for light in layout.steering().filter(|_| part.steer) {
        let both = base.zip(light.into(), u8::max);
        let steered = format!(" with the steered lamp {}", layout.name(Some(light)));
        allowed.permit(both).map_err(not_allowed(steered))?;
    }
    if part.ramp_min > 0 && allowed.is_one() {
        return Err(PartProblem::RampWithoutLevels(part.ramp_min));
    }
    Ok(base)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lamps::Light;

    fn part(text: &str) -> Part {
        serde_json::from_str(text).unwrap()
    }

    const ANY: Allowed = Allowed::Any { most_lit: 3, budget: 2.0 };

    fn programme(parts: &[&str], allowed: Allowed) -> Result<Programme, String> {
        let parts: Vec<Part> = parts.iter().map(|text| part(text)).collect();
        Programme::new(&parts, &Layout::four_sides(), allowed).map_err(|error| error.to_string())
    }

    fn time(word: &str) -> TimeOfDay {
        word.parse().unwrap()
    }

    #[test]
    fn by_day_the_controller_steers_and_the_night_is_dark() {
        let day = programme(&[r#"{"from": "06:00", "to": "22:00"}"#], Allowed::One).unwrap();
        let right = Lighting::only(Light::RIGHT);
        for (at, lit) in [
            ("05:59", Lighting::DARK),
            ("06:00", right),
            ("21:59", right),
            ("22:00", Lighting::DARK),
            ("24:00", Lighting::DARK),
            ("00:00", Lighting::DARK),
        ] {
            assert_eq!(day.at(time(at)).lighting(right), lit, "{at}");
        }
        assert_eq!((day.at(time("12:00")).part, day.at(time("23:00")).part), (1, 0));
    }

    #[test]
    fn a_part_may_lie_over_midnight_or_be_the_whole_day() {
        let night = programme(&[r#"{"from": "22:00", "to": "06:00"}"#], Allowed::One).unwrap();
        let parts = ["21:59", "22:00", "23:59", "00:00", "05:59", "06:00"].map(|at| night.at(time(at)).part);
        assert_eq!(parts, [0, 1, 1, 1, 1, 0]);
        let day = programme(&[r#"{"from": "00:00", "to": "24:00"}"#], Allowed::One).unwrap();
        assert!((0..2 * 1440).all(|minute| day.at(TimeOfDay::MIDNIGHT.later(minute)).part == 1));
    }

    #[test]
    fn a_base_light_shines_under_the_steering_and_alone() {
        let parts = [
            r#"{"from": "06:00", "to": "22:00", "base": "front:64+right:10", "ramp_min": 30}"#,
            r#"{"from": "22:00", "to": "02:00", "base": "back:8", "steer": false}"#,
        ];
        let programme = programme(&parts, ANY).unwrap();
        let lit = |at: &str| programme.at(time(at)).lighting(Light::RIGHT.into()).word(&Layout::four_sides());
        assert_eq!(lit("12:00"), "right+front:64", "of a lamp that is in both the higher level");
        assert_eq!(lit("06:00"), "right");
        assert_eq!(lit("06:15"), "right+front:32");
        assert_eq!(lit("06:30"), "right+front:64");
        assert_eq!(lit("21:45"), "right+front:32");
        assert_eq!(lit("22:00"), "back:8");
        assert_eq!(lit("02:00"), "dark");
        assert_eq!(programme.dimmed().word(&Layout::four_sides()), "right:10+front:64+back:8");
    }

    #[test]
    fn a_ramp_goes_over_into_the_adjoining_part() {
        let parts = [
            r#"{"from": "06:00", "to": "22:00", "base": "front:108", "ramp_min": 60}"#,
            r#"{"from": "22:00", "to": "06:00", "base": "front:8", "steer": false, "ramp_min": 60}"#,
        ];
        let programme = programme(&parts, ANY).unwrap();
        let level = |at: &str| programme.at(time(at)).base.level(Light::FRONT);
        assert_eq!(
            ["05:59", "06:00", "06:30", "07:00", "21:30", "21:59", "22:00"].map(level),
            [8, 8, 58, 108, 58, 10, 8]
        );
    }

    #[test]
    fn what_contradicts_itself_is_refused_with_a_mend() {
        let day = r#"{"from": "06:00", "to": "22:00"}"#;
        let problem = |parts: &[&str], allowed| programme(parts, allowed).unwrap_err();
        assert_eq!(
            problem(&[day, r#"{"from": "21:00", "to": "06:00"}"#], ANY),
            "programme 2: found 21:00 to 06:00, wanted no time of programme 1, 06:00 to 22:00: let each begin where the \
             other ends"
        );
        assert!(programme(&[day, r#"{"from": "22:00", "to": "06:00"}"#], ANY).is_ok());
        for (text, allowed, wanted) in [
            (r#"{"from": "06:00", "to": "06:00"}"#, ANY, "found from and to both 06:00"),
            (
                r#"{"from": "06:00", "to": "22:00", "base": "topp:3"}"#,
                ANY,
                "base: found light \"topp\", wanted left",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "base": "front", "ramp_min": 31}"#,
                ANY,
                "at most half of the part, 30",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "ramp_min": 30}"#,
                ANY,
                "ramp_min = 30 without a base light",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "base": "front+back:9"}"#,
                ANY,
                "base = \"front+back:9\" with the steered lamp left: found a power of 2.04 full lamps, wanted at most 2 \
                 (`budget`); lower the base, set steer = false",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "base": "front"}"#,
                Allowed::One,
                "with the steered lamp left: found 2 lit lamps",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "base": "front:9", "steer": false}"#,
                Allowed::One,
                "base = \"front:9\": found 1 lit lamps",
            ),
            (
                r#"{"from": "06:00", "to": "07:00", "base": "front", "steer": false, "ramp_min": 9}"#,
                Allowed::One,
                "found ramp_min = 9, wanted `allowed",
            ),
        ] {
            let found = problem(&[text], allowed);
            assert!(found.starts_with("programme 1: ") && found.contains(wanted), "{found}");
        }
        let alone = r#"{"from": "06:00", "to": "07:00", "base": "front", "steer": false}"#;
        assert_eq!(programme(&[alone], Allowed::One).unwrap().dimmed(), Lighting::DARK);
    }

    #[test]
    fn times_are_read_as_they_are_written() {
        for word in ["00:00", "06:05", "23:59", "24:00"] {
            assert_eq!(time(word).to_string(), word);
        }
        for word in ["6:00", "24:01", "12:60", "12", "-1:00", "+1:00", "12:00:00", ""] {
            assert!(word.parse::<TimeOfDay>().is_err(), "{word}");
        }
        assert_eq!(time("23:00").later(90), time("00:30"));
    }

    proptest! {
        /// Whatever the controller decides of one lamp, at no minute is more lit than the rig allows, and a ramp jumps
        /// nowhere by more than its slope.
        #[test]
        fn no_minute_exceeds_what_is_allowed(
            from in 0_u64..1440, length in 2_u64..1440, base in proptest::array::uniform4(0_u8..=255), ramp in 1_u16..200,
            most_lit in 1_u8..=4, budget in 0.5..4.0, steer in proptest::bool::ANY, decided in 0_usize..4,
        ) {
            let layout = Layout::four_sides();
            let base = layout.lights().zip(base).fold(Lighting::DARK, |all, (light, level)| all.with(light, level));
            let from = TimeOfDay::MIDNIGHT.later(from);
            let part = Part { from, to: from.later(length), steer, base: base.word(&layout), ramp_min: ramp };
            let allowed = Allowed::Any { most_lit, budget };
            let Ok(programme) = Programme::new(&[part], &layout, allowed) else { return Ok(()) };
            let decided = Lighting::from(Light::new(decided));
            let slope = f64::from(FULL) / f64::from(ramp) + 1.0;
            let mut last = programme.at(from).base;
            for minute in 0..1440 {
                let acting = programme.at(from.later(minute));
                let lit = acting.lighting(decided);
                prop_assert!(allowed.permit(lit).is_ok(), "{minute}: {lit}");
                for light in layout.lights() {
                    let step = f64::from(acting.base.level(light)) - f64::from(last.level(light));
                    prop_assert!(step.abs() <= slope, "{minute}: {} after {last}", acting.base);
                }
                last = acting.base;
            }
        }
    }
}
