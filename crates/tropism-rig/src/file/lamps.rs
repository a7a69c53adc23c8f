//! `[lamps]` of a rig file: 2 to 16 lamps by name.
//!
//! Each lamp has a driver, and all of them stand behind one [`Interlock`]; or one program for each lamp, and one for
//! darkness, switch all lamps at once.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use tropism::lamps::{self, Colour, Layout};
use tropism::lighting::Allowed;
use tropism::rig::{Lamps, OnExit, RigError};

use crate::broker::Broker;
use crate::command::CommandLamps;
use crate::device;
use crate::driver::LampDriver;
use crate::seconds::{Seconds, twenty};
use crate::switch::Interlock;

/// Darkness between one lamp and another if `pause_s` is left out: chosen, longer than a relay or a plug takes to open.
const PAUSE: Seconds = Seconds::new(0.2);

/// The greatest photon flux density of a lamp at the plant, in µmol/m²/s: more than the sun gives.
pub const MOST_UMOL: f64 = 3000.0;

/// `value`, if it is above 0 and at most `most`, which has a `unit`.
fn positive(value: f64, most: f64, unit: &str) -> Result<f64, String> {
    if value > 0.0 && value <= most {
        return Ok(value);
    }
    Err(format!("found {value}, wanted above 0 and at most {most} {unit}"))
}

/// The lamps of a rig, and how they are switched.
///
/// In a file, each lamp is a key of `[lamps]` beside the settings of all lamps. `left`, `right`, `front` and `back` stand
/// at the places of [`Layout::four_sides`]; a lamp of any other name has its place in `at`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LampsTable {
    /// The lamps in the order of the layout: `left`, `right`, `front`, `back`, then the others as in the file.
    #[cfg_attr(feature = "schema", schemars(flatten, with = "BTreeMap<String, LampControl>"))]
    pub lamps: Vec<NamedLamp>,
    /// The program that darkens all lamps, beside one program for each.
    pub dark: Option<Vec<String>>,
    /// Time limit of a program. 20 s if it is left out.
    pub timeout_s: Option<Seconds>,
    /// Seconds of darkness between one lamp and another, where each has a driver. 0.2 if it is left out.
    pub pause_s: Option<Seconds>,
    /// Which lamps may shine together. One at a time, at full power, if it is left out; else lamps with drivers.
    #[cfg_attr(feature = "schema", schemars(default))]
    pub allowed: Allowed,
    /// Hours of light at most in any 24 hours, above 0 and at most 24; then all lamps are dark until there is room again.
    pub max_light_h: Option<f64>,
    /// Photons at most in any 24 hours, in mol/m^2 at the plant, above 0 and at most 100; wants `umol` of each lamp.
    pub max_mol: Option<f64>,
    /// Places by name, in cm from the root: x to the right, y up from the soil, z towards the camera.
    #[cfg_attr(feature = "schema", schemars(default))]
    pub at: BTreeMap<String, [f64; 3]>,
    /// Colours by name. A lamp without one is blue; controllers choose among blue and white ones.
    #[cfg_attr(feature = "schema", schemars(default))]
    pub colours: BTreeMap<String, Colour>,
    /// Photon flux density at the plant under each lamp at full power, by name, in µmol/m²/s: above 0 and at most 3000. `tropism
    /// check --light` asks for a meter's readings.
    #[cfg_attr(feature = "schema", schemars(default))]
    pub umol: BTreeMap<String, f64>,
    /// State of the lamps after a run ends, for any reason. Dark if it is left out.
    #[cfg_attr(feature = "schema", schemars(default))]
    pub on_exit: OnExit,
}

/// One lamp of a rig file.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLamp {
    /// Name, as in tracks and figures.
    pub name: String,
    /// How it is switched.
    pub control: LampControl,
}

/// How a lamp is switched.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum LampControl {
    /// The words of a program that lights this lamp and darkens all others.
    Command(Vec<String>),
    /// A driver for this lamp alone.
    Driver(Box<LampDriver>),
}

impl<'de> Deserialize<'de> for LampControl {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = LampControl;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a lamp (a table with a driver, or the words of a program)")
            }

            fn visit_seq<S: SeqAccess<'de>>(self, words: S) -> Result<LampControl, S::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(words)).map(LampControl::Command)
            }

            fn visit_map<M: MapAccess<'de>>(self, table: M) -> Result<LampControl, M::Error> {
                let driver = LampDriver::deserialize(MapAccessDeserializer::new(table))?;
                Ok(LampControl::Driver(Box::new(driver)))
            }
        }

        deserializer.deserialize_any(Either)
    }
}

// By hand: what serde derives for `flatten` loses the line of an error.
impl<'de> Deserialize<'de> for LampsTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;

        impl<'de> Visitor<'de> for Table {
            type Value = LampsTable;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of lamps")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<LampsTable, M::Error> {
                let mut table = LampsTable {
                    lamps: Vec::new(),
                    dark: None,
                    timeout_s: None,
                    pause_s: None,
                    allowed: Allowed::One,
                    max_light_h: None,
                    max_mol: None,
                    at: BTreeMap::new(),
                    colours: BTreeMap::new(),
                    umol: BTreeMap::new(),
                    on_exit: OnExit::default(),
                };
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        lamps::DARK => table.dark = Some(map.next_value()?),
                        "timeout_s" => table.timeout_s = Some(map.next_value()?),
                        "pause_s" => table.pause_s = Some(map.next_value()?),
                        "allowed" => table.allowed = map.next_value()?,
                        "max_light_h" => {
                            let hours = positive(map.next_value()?, 24.0, "hours");
                            table.max_light_h = Some(hours.map_err(M::Error::custom)?);
                        }
                        "max_mol" => {
                            let photons = positive(map.next_value()?, 100.0, "mol/m²");
                            table.max_mol = Some(photons.map_err(M::Error::custom)?);
                        }
                        "at" => table.at = map.next_value()?,
                        "colours" => table.colours = map.next_value()?,
                        "umol" => {
                            table.umol = map.next_value()?;
                            for (name, &flux) in &table.umol {
                                let checked = positive(flux, MOST_UMOL, "µmol/m²/s");
                                checked.map_err(|error| M::Error::custom(format!("umol.{name}: {error}")))?;
                            }
                        }
                        "on_exit" => table.on_exit = map.next_value()?,
                        _ if table.lamps.iter().any(|lamp| lamp.name == key) => {
                            return Err(M::Error::custom(format!("two lamps are named {key}")));
                        }
                        _ => table.lamps.push(NamedLamp { name: key, control: map.next_value()? }),
                    }
                }
                let standard = Layout::four_sides();
                let rank = |lamp: &NamedLamp| {
                    let at = standard.lamps().iter().position(|known| known.name == lamp.name);
                    at.unwrap_or(usize::MAX)
                };
                table.lamps.sort_by_key(rank);
                Ok(table)
            }
        }

        deserializer.deserialize_map(Table)
    }
}

impl Serialize for LampsTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for NamedLamp { name, control } in &self.lamps {
            map.serialize_entry(name, control)?;
        }
        if let Some(dark) = &self.dark {
            map.serialize_entry(lamps::DARK, dark)?;
        }
        if let Some(timeout_s) = &self.timeout_s {
            map.serialize_entry("timeout_s", timeout_s)?;
        }
        if let Some(pause_s) = &self.pause_s {
            map.serialize_entry("pause_s", pause_s)?;
        }
        if !self.allowed.is_one() {
            map.serialize_entry("allowed", &self.allowed)?;
        }
        if let Some(hours) = &self.max_light_h {
            map.serialize_entry("max_light_h", hours)?;
        }
        if let Some(photons) = &self.max_mol {
            map.serialize_entry("max_mol", photons)?;
        }
        if !self.at.is_empty() {
            map.serialize_entry("at", &self.at)?;
        }
        if !self.colours.is_empty() {
            map.serialize_entry("colours", &self.colours)?;
        }
        if !self.umol.is_empty() {
            map.serialize_entry("umol", &self.umol)?;
        }
        map.serialize_entry("on_exit", &self.on_exit)?;
        map.end()
    }
}

impl LampsTable {
    /// Names, places and colours of the lamps.
    ///
    /// # Errors
    /// A line that names the lamp: one without a place, a place without a lamp, or what [`Layout::new`] refuses.
    pub fn layout(&self) -> Result<Layout, String> {
        let at = self.at.keys().map(|name| ("at", name));
        let colours = self.colours.keys().map(|name| ("colours", name));
        let umol = self.umol.keys().map(|name| ("umol", name));
        let is_unknown = |(_, name): &(&str, &String)| self.lamps.iter().all(|lamp| lamp.name != **name);
        if let Some((key, name)) = at.chain(colours).chain(umol).find(is_unknown) {
            return Err(format!("lamps.{key}: {name} is no lamp of [lamps]"));
        }
        let standard = Layout::four_sides();
        let place = |name: &str| {
            let known = standard.lamps().iter().find(|lamp| lamp.name == name);
            self.at.get(name).copied().or_else(|| known.map(|lamp| lamp.at)).ok_or_else(|| {
                format!(
                    "lamps.{name}: it needs a place, at = {{ {name} = [x, y, z] }} in [lamps] (cm from the root: x to \
                     the right, y up, z towards the camera), or one of the names left, right, front, back"
                )
            })
        };
        let lamps = self.lamps.iter().map(|NamedLamp { name, .. }| {
            let colour = self.colours.get(name).copied().unwrap_or_default();
            Ok(lamps::Lamp::new(name, place(name)?).with_colour(colour))
        });
        Layout::new(lamps.collect::<Result<_, String>>()?).map_err(|error| format!("lamps: {error}"))
    }

    /// Photon flux density under each lamp at full power, in the order of the lamps, in µmol/m²/s; `None` unless all are known.
    #[must_use]
    pub fn flux(&self) -> Option<Vec<f64>> {
        self.lamps.iter().map(|lamp| self.umol.get(&lamp.name).copied()).collect()
    }

    /// The lamps that have drivers, with their names.
    pub fn drivers(&self) -> impl Iterator<Item = (&str, &LampDriver)> {
        self.lamps.iter().filter_map(|lamp| match &lamp.control {
            LampControl::Driver(driver) => Some((lamp.name.as_str(), &**driver)),
            LampControl::Command(_) => None,
        })
    }

    /// The lamps that have programs, with their names.
    fn commands(&self) -> impl Iterator<Item = (&str, &[String])> {
        self.lamps.iter().filter_map(|lamp| match &lamp.control {
            LampControl::Command(words) => Some((lamp.name.as_str(), words.as_slice())),
            LampControl::Driver(_) => None,
        })
    }

    /// What a file may have got wrong, if there are `period_min` minutes between commands: each names the key, what was found
    /// and what was wanted.
    pub(super) fn faults(&self, period_min: f64) -> Vec<String> {
        if let Err(problem) = self.layout() {
            return vec![problem];
        }
        if let Err(problem) = self.allowed.check() {
            return vec![format!("lamps.allowed: {problem}")];
        }
        if let Some(lamp) = self.lamps.iter().find(|lamp| !self.umol.contains_key(&lamp.name))
            && self.max_mol.is_some()
        {
            return vec![format!(
                "lamps.max_mol: photons are counted by the umol of each lamp, and {} has none: measure it with `tropism check \
                 --light`",
                lamp.name
            )];
        }
        match (self.drivers().next(), self.commands().next()) {
            (Some((driver, _)), Some((command, _))) => {
                let names: Vec<&str> = self.lamps.iter().map(|lamp| lamp.name.as_str()).collect();
                vec![format!(
                    "lamps: found a driver for {driver} and a program for {command}, wanted {} alike",
                    names.join(" and ")
                )]
            }
            (Some(_), None) => self.driver_faults(period_min),
            (None, _) if self.dark.is_none() => {
                vec!["lamps: there is no `dark`, the program that darkens all lamps".to_owned()]
            }
            (None, _) if !self.allowed.is_one() => {
                vec![
                    "lamps: `allowed` needs a driver for each lamp, and these are programs that switch all"
                        .to_owned(),
                ]
            }
            (None, _) if self.pause_s.is_some() => {
                vec![
                    "lamps: `pause_s` is for lamps with drivers, and these are programs that switch all"
                        .to_owned(),
                ]
            }
            (None, _) => Vec::new(),
        }
    }

    fn driver_faults(&self, period_min: f64) -> Vec<String> {
        let mut faults = Vec::new();
        if self.dark.is_some() || self.timeout_s.is_some() {
            faults.push(
                "lamps: found dark or timeout_s beside lamps with drivers, wanted them only for programs that switch all \
                 lamps"
                    .to_owned(),
            );
        }
        let drivers: Vec<_> = self.drivers().collect();
        for (number, (name, driver)) in drivers.iter().enumerate() {
            if let Some((other, _)) = drivers[..number]
                .iter()
                .find(|(_, other)| driver.settings().outlet().overlaps(&other.settings().outlet()))
            {
                faults.push(format!("lamps: {other} and {name} are on the same pixels, line or plug"));
            }
        }
        let is_gpio = |driver: &LampDriver| matches!(driver, LampDriver::Gpio(_));
        if self.on_exit == OnExit::Keep && drivers.iter().any(|(_, driver)| is_gpio(driver)) {
            faults.push(
                "lamps: found on_exit = \"keep\" with a lamp on a GPIO line, which goes off when its program ends, wanted \
                 \"dark\""
                    .to_owned(),
            );
        }
        let fault = |(name, driver): &(&str, &LampDriver)| {
            driver.settings().check(period_min).err().map(|problem| format!("lamps.{name}: {problem}"))
        };
        faults.extend(drivers.iter().filter_map(fault));
        faults
    }

    /// Each lamp that a run drives, as errors name it, and what it is.
    pub(crate) fn identities(&self, broker: Option<&Broker>) -> Vec<(String, String)> {
        let programs = self.commands().map(|(name, words)| (device_name(name), device::command(words)));
        let drivers = self
            .drivers()
            .map(|(name, driver)| (device_name(name), driver.settings().outlet().identity(broker)));
        programs.chain(drivers).collect()
    }

    /// Opens all lamps. `broker` is the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if a device cannot be found.
    pub fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Lamps>, RigError> {
        if let Some(programs) = self.programs() {
            return Ok(Box::new(programs));
        }
        let switches =
            self.drivers().map(|(name, driver)| driver.settings().open(&device_name(name), broker));
        let pause = self.pause_s.unwrap_or(PAUSE).duration();
        let interlock = Interlock::new(switches.collect::<Result<Vec<_>, _>>()?, pause);
        Ok(Box::new(interlock.allowing(self.allowed)))
    }

    /// Seconds that a command to all lamps may take.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        match self.drivers().next() {
            Some(_) => self.drivers().map(|(_, driver)| driver.settings().timeout_s()).sum(),
            None => self.timeout_s.unwrap_or(twenty()).into(),
        }
    }

    /// The programs that switch all lamps; `None` where lamps have drivers.
    pub(crate) fn programs(&self) -> Option<CommandLamps> {
        self.drivers().next().is_none().then(|| CommandLamps {
            lamps: self.commands().map(|(_, words)| words.to_vec()).collect(),
            dark: self.dark.clone().unwrap_or_default(),
            timeout: self.timeout_s.unwrap_or(twenty()).duration(),
        })
    }
}

/// What errors call the lamp `name`.
pub(crate) fn device_name(name: &str) -> String {
    format!("{name} lamp")
}
