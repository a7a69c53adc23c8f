//! The rig file: what stands in a tent.

use std::fmt;
use std::time::Duration;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use tropism::greenhouse::tent::{Greenhouse, TentHandle};
use tropism::rig::{Camera, Clock, Flash, Lamps, OnExit, Rig, RigError};
use tropism::rig::{Durability, FaultPolicy, LampsInView};
use tropism::track::PAPER_PERIOD_MIN;
use tropism::vision::{Calibration, Eye, VisionConfig};

use crate::alert::Alerts;
use crate::clock::TentClock;
use crate::command::CommandLamps;
use crate::driver::{AlertDriver, CameraDriver, FlashDriver, LampDriver};
use crate::mqtt::Broker;
use crate::seconds::Seconds;
use crate::switch::{Interlock, NoFlash};

/// A rig whose drivers are chosen by a file.
pub type AnyRig = Rig<Box<dyn Camera>, Box<dyn Lamps>, Box<dyn Flash>, Box<dyn Clock>>;

/// A rig file. Either `greenhouse`, or `camera`, `lamps` and `calibration`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigFile {
    /// What a power cut may cost: `full` durability loses no step, `fast` writes without waiting for the disk. A real
    /// tent is `full` if the file does not say, the virtual one `fast`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub durability: Option<Durability>,
    /// Minutes between photographs. Paper: 5.
    #[serde(default = "five")]
    pub period_min: f64,
    /// What a run bears before it asks. A virtual tent bears everything if the file does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patience: Option<FaultPolicy>,
    /// Where the photographs show the lamps; if it is left out, that is not looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamps_in_view: Option<LampsInView>,
    /// The virtual tent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greenhouse: Option<Greenhouse>,
    /// A real camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraDriver>,
    /// Real lamps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamps: Option<LampsTable>,
    /// A real flash; none if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flash: Option<FlashDriver>,
    /// The broker behind which plugs and relays are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mqtt: Option<Broker>,
    /// By which people are told what happens. Not written into run folders: it decides nothing of a run's outcome, may
    /// change while a run is interrupted, and holds addresses that are nobody's business.
    #[serde(default, skip_serializing)]
    pub alert: Vec<AlertDriver>,
    /// How the real camera's photographs map to centimetres. The virtual camera knows its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// How the plant is found in the photographs.
    #[serde(default)]
    pub vision: VisionConfig,
}

const fn five() -> f64 {
    PAPER_PERIOD_MIN
}

/// The two lamps: each with a driver, behind one interlock, or both behind three programs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LampsTable {
    /// The left one, or the program that lights it and darkens the right one.
    pub left: Lamp,
    /// The right one, or the program that lights it and darkens the left one.
    pub right: Lamp,
    /// The program that darkens both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark: Option<Vec<String>>,
    /// Seconds until a program is given up. 20 if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeout_s: Option<Seconds>,
    /// Seconds of darkness between one lamp and the other, where each has a driver. 0.2 if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause_s: Option<Seconds>,
    /// What becomes of them when a run ends, however that comes about. Dark if it is left out.
    #[serde(default)]
    pub on_exit: OnExit,
}

/// One lamp of two.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Lamp {
    /// A program for both.
    Command(Vec<String>),
    /// A driver of its own.
    Driver(Box<LampDriver>),
}

impl<'de> Deserialize<'de> for Lamp {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = Lamp;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table with a driver, or the words of a program")
            }

            fn visit_seq<S: SeqAccess<'de>>(self, words: S) -> Result<Lamp, S::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(words)).map(Lamp::Command)
            }

            fn visit_map<M: MapAccess<'de>>(self, table: M) -> Result<Lamp, M::Error> {
                let driver = LampDriver::deserialize(MapAccessDeserializer::new(table))?;
                Ok(Lamp::Driver(Box::new(driver)))
            }
        }

        deserializer.deserialize_any(Either)
    }
}

impl LampsTable {
    fn check(&self, period_min: f64) -> Result<(), String> {
        match (&self.left, &self.right) {
            (Lamp::Driver(left), Lamp::Driver(right)) => {
                if self.dark.is_some() || self.timeout_s.is_some() {
                    return Err("lamps: found dark or timeout_s beside lamps with drivers, wanted them only for \
                                programs that know both"
                        .to_owned());
                }
                if left.overlaps(right) {
                    return Err("lamps: found left and right on the same pixels, line or plug, wanted two lamps"
                        .to_owned());
                }
                let is_let_go = |lamp: &LampDriver| matches!(lamp, LampDriver::Gpio(_));
                if self.on_exit == OnExit::Keep && (is_let_go(left) || is_let_go(right)) {
                    return Err("lamps: found on_exit = \"keep\" with a lamp on a GPIO line, which goes off when its \
                                program ends, wanted \"dark\""
                        .to_owned());
                }
                left.check(period_min).map_err(|problem| format!("lamps.left: {problem}"))?;
                right.check(period_min).map_err(|problem| format!("lamps.right: {problem}"))
            }
            (Lamp::Command(_), Lamp::Command(_)) if self.dark.is_none() => {
                Err("lamps: found no dark, wanted the program that darkens both".to_owned())
            }
            (Lamp::Command(_), Lamp::Command(_)) if self.pause_s.is_some() => {
                Err("lamps: found pause_s beside programs that know both lamps, wanted it only for lamps with drivers"
                    .to_owned())
            }
            (Lamp::Command(_), Lamp::Command(_)) => Ok(()),
            _ => Err("lamps: found a driver for one lamp and a program for both, wanted left and right alike"
                .to_owned()),
        }
    }

    /// Both lamps. `broker` is the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if one cannot be found.
    pub fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Lamps>, RigError> {
        let pause = self.pause_s.unwrap_or(Seconds::new(0.2)).duration();
        Ok(match (&self.left, &self.right) {
            (Lamp::Driver(left), Lamp::Driver(right)) => Box::new(Interlock::new(
                left.open("left lamp", broker)?,
                right.open("right lamp", broker)?,
                pause,
            )),
            _ => Box::new(self.programs()),
        })
    }

    /// The programs that know both lamps.
    pub(crate) fn programs(&self) -> CommandLamps {
        let words = |lamp: &Lamp| match lamp {
            Lamp::Command(words) => words.clone(),
            Lamp::Driver(_) => Vec::new(),
        };
        CommandLamps {
            left: words(&self.left),
            right: words(&self.right),
            dark: self.dark.clone().unwrap_or_default(),
            timeout: self.timeout_s.map_or(Duration::from_secs(20), Seconds::duration),
        }
    }
}

/// A rig file that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RigFileError(String);

/// An opened rig.
pub struct OpenRig {
    /// The rig.
    pub rig: AnyRig,
    /// The handle that gives ground truth, if the tent is virtual.
    pub truth: Option<TentHandle>,
}

impl RigFile {
    /// The virtual tent with the paper's geometry and beans that differ as real ones do.
    #[must_use]
    pub fn greenhouse(greenhouse: Greenhouse, vision: VisionConfig) -> Self {
        Self {
            durability: None,
            period_min: PAPER_PERIOD_MIN,
            patience: None,
            lamps_in_view: None,
            greenhouse: Some(greenhouse),
            camera: None,
            lamps: None,
            flash: None,
            mqtt: None,
            alert: Vec::new(),
            calibration: None,
            vision,
        }
    }

    /// Whether the plant is virtual.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        self.greenhouse.is_some()
    }

    /// What a power cut may cost.
    #[must_use]
    pub fn durability(&self) -> Durability {
        self.durability.unwrap_or(if self.is_virtual() { Durability::Fast } else { Durability::Full })
    }

    /// What a run in it bears before it asks.
    #[must_use]
    pub fn patience(&self) -> FaultPolicy {
        let usual = if self.is_virtual() { FaultPolicy::unlimited } else { FaultPolicy::default };
        self.patience.clone().unwrap_or_else(usual)
    }

    /// How photographs of this rig map to centimetres.
    #[must_use]
    pub fn calibration(&self) -> Option<Calibration> {
        self.greenhouse.as_ref().map(Greenhouse::calibration).or(self.calibration)
    }

    /// Opens all channels by which people are told; `run` is the run's name.
    ///
    /// # Errors
    /// [`RigError::Device`] if a secret cannot be read or a channel wants a broker that the file does not name. A network
    /// that is down is no error.
    pub fn open_alerts(&self, run: &str) -> Result<Alerts, RigError> {
        Alerts::open(self.alert.iter().map(AlertDriver::settings), self.mqtt.as_ref(), run)
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`RigFileError`] names the key, what was found and what was wanted.
    pub fn check(&self) -> Result<(), RigFileError> {
        let error = |line: String| Err(RigFileError(line));
        if !(self.period_min > 0.0 && self.period_min <= 24.0 * 60.0) {
            return error(format!("found period_min = {}, wanted above 0 and at most 1440", self.period_min));
        }
        self.patience.iter().try_for_each(FaultPolicy::check).map_err(RigFileError)?;
        if let (Some(lamps), Some(Calibration { width, height, .. })) =
            (&self.lamps_in_view, self.calibration())
        {
            lamps.check(width, height).map_err(RigFileError)?;
        }
        for (number, alert) in (1..).zip(&self.alert) {
            alert.check().map_err(|problem| RigFileError(format!("alert {number}: {problem}")))?;
        }
        if let Some(greenhouse) = &self.greenhouse {
            if self.camera.is_some()
                || self.lamps.is_some()
                || self.flash.is_some()
                || self.mqtt.is_some()
                || self.calibration.is_some()
            {
                return error("found greenhouse beside real devices, wanted one or the other".to_owned());
            }
            return greenhouse.check().map_err(|problem| RigFileError(problem.to_string()));
        }
        let (camera, lamps, calibration) = match (&self.camera, &self.lamps, &self.calibration) {
            (Some(camera), Some(lamps), Some(calibration)) => (camera, lamps, calibration),
            (camera, lamps, calibration) => {
                let missing = [
                    ("camera", camera.is_none()),
                    ("lamps", lamps.is_none()),
                    ("calibration", calibration.is_none()),
                ];
                let missing: Vec<&str> =
                    missing.iter().filter(|(_, is_missing)| *is_missing).map(|(key, _)| *key).collect();
                return error(format!("found no {}, wanted them, or greenhouse instead", missing.join(", ")));
            }
        };
        camera.check().map_err(|problem| RigFileError(format!("camera: {problem}")))?;
        lamps.check(self.period_min).map_err(RigFileError)?;
        if let Some(flash) = &self.flash {
            flash.check().map_err(|problem| RigFileError(format!("flash: {problem}")))?;
        }
        let found = |problem: tropism::vision::VisionError| RigFileError(problem.to_string());
        calibration.check().map_err(found)?;
        self.vision.check(calibration.width, calibration.height).map_err(found)
    }

    /// Opens the rig. `seed` is the plant's if it is virtual; a real one's experiment began `since_start` ago.
    ///
    /// # Errors
    /// [`RigFileError`], as [`Self::check`], or if a device cannot be found.
    pub fn open(&self, seed: u64, since_start: Duration) -> Result<OpenRig, RigFileError> {
        self.check()?;
        let found = |problem: tropism::vision::VisionError| RigFileError(problem.to_string());
        let period = Duration::from_secs_f64(self.period_min * 60.0);
        if let Some(greenhouse) = &self.greenhouse {
            let (device, eye) = greenhouse.open(seed, self.period_min, &self.vision).map_err(found)?;
            let hand = || device.clone();
            let rig = Rig::new(
                Box::new(hand()) as Box<dyn Camera>,
                Box::new(hand()) as Box<dyn Lamps>,
                Box::new(hand()) as Box<dyn Flash>,
                Box::new(hand()) as Box<dyn Clock>,
                eye,
                period,
            )
            .with_layout(greenhouse.layout.clone());
            return Ok(OpenRig { rig, truth: Some(device) });
        }
        let (Some(camera), Some(lamps), Some(calibration)) = (&self.camera, &self.lamps, self.calibration)
        else {
            return Err(RigFileError("found no devices, wanted camera, lamps and calibration".to_owned()));
        };
        let eye = Eye::new(calibration, self.vision.clone()).map_err(found)?;
        let device = |error: RigError| RigFileError(error.to_string());
        let flash = match &self.flash {
            Some(flash) => flash.open(self.mqtt.as_ref()).map_err(device)?,
            None => Box::new(NoFlash),
        };
        let (clock, on_exit) = (Box::new(TentClock::new(since_start)) as Box<dyn Clock>, lamps.on_exit);
        let (camera, lamps) =
            (camera.open().map_err(device)?, lamps.open(self.mqtt.as_ref()).map_err(device)?);
        let rig = Rig::new(camera, lamps, flash, clock, eye, period).with_on_exit(on_exit);
        Ok(OpenRig { rig, truth: None })
    }
}

#[cfg(test)]
mod tests {
    use tropism::environment::Environment;
    use tropism::lamps::Light;

    use super::*;

    /// All that a rig file must have beside its devices.
    const REST: &str =
        "[calibration]\npx_per_cm = 35.0\nwidth = 2592\nheight = 1944\nbase = { x = 1296.0, y = 1700.0 }\n";

    fn parse(text: &str) -> Result<RigFile, toml::de::Error> {
        toml::from_str(&format!("{text}{REST}"))
    }

    /// The line in which an error is, and what it says.
    fn error(text: &str) -> (String, String) {
        let text = format!("{text}{REST}");
        let error = toml::from_str::<RigFile>(&text).unwrap_err();
        let before = &text[..error.span().unwrap().start];
        let line = text.lines().nth(before.matches('\n').count()).unwrap();
        (line.to_owned(), error.message().to_owned())
    }

    const CAMERA: &str = "[camera]\ndriver = \"command\"\ncommand = [\"camera\"]\n";
    const LAMPS: &str = "[lamps.left]\ndriver = \"command\"\non = [\"l\"]\noff = [\"l0\"]\n\
                         [lamps.right]\ndriver = \"command\"\non = [\"r\"]\noff = [\"r0\"]\n";

    #[test]
    fn a_rig_file_of_drivers_is_written_as_it_is_read() {
        let rig = parse(&format!("{CAMERA}{LAMPS}[flash]\non = [\"f\"]\noff = [\"f0\"]\n")).unwrap();
        rig.check().unwrap();
        let text = toml::to_string(&rig).unwrap();
        assert_eq!(toml::from_str::<RigFile>(&text).unwrap(), rig, "{text}");
        assert!(text.contains("[lamps.left]\ndriver = \"command\""), "{text}");
        let pair = parse(&format!(
            "{CAMERA}[lamps]\nleft = [\"l\"]\nright = [\"r\"]\ndark = [\"d\"]\ntimeout_s = 3\n"
        ));
        let pair = pair.unwrap();
        pair.check().unwrap();
        assert_eq!(toml::from_str::<RigFile>(&toml::to_string(&pair).unwrap()).unwrap(), pair);
    }

    #[test]
    fn an_error_in_the_table_of_a_driver_has_its_line_if_the_driver_comes_first() {
        let (line, problem) = error("[camera]\ndriver = \"command\"\ncomand = [\"x\"]\n");
        assert!(
            line == "comand = [\"x\"]" && problem.contains("unknown field `comand`"),
            "{line}: {problem}"
        );
        let (line, problem) = error("[camera]\ndriver = \"command\"\ncommand = [\"x\"]\ntimeout_s = -1\n");
        assert!(
            line == "timeout_s = -1" && problem.contains("wanted 0 to 3600 seconds"),
            "{line}: {problem}"
        );
        let (line, problem) = error("[lamps.left]\ndriver = \"command\"\non = 5\n");
        assert!(line == "on = 5" && problem.contains("invalid type"), "{line}: {problem}");
        // Later, there is the table, and the name of the key.
        let (line, problem) = error("[camera]\ncomand = [\"x\"]\ndriver = \"command\"\n");
        assert!(line == "[camera]" && problem.contains("comand"), "{line}: {problem}");
        let (_, problem) = error("[camera]\ncommand = 7\n");
        assert!(problem.contains("`command`"), "{problem}");
        let (_, problem) = error("[flash]\ndriver = \"comand\"\n");
        assert!(problem.contains("found driver \"comand\", wanted one of command"), "{problem}");
    }

    #[test]
    fn lamps_are_two_of_a_kind() {
        let problem =
            |lamps: &str| parse(&format!("{CAMERA}{lamps}")).unwrap().check().unwrap_err().to_string();
        let pair = "[lamps]\nleft = [\"l\"]\nright = [\"r\"]\n";
        assert!(problem(pair).contains("found no dark"));
        assert!(problem(&format!("{pair}dark = [\"d\"]\npause_s = 1\n")).contains("pause_s"));
        assert!(problem(&format!("[lamps]\ntimeout_s = 5\n{LAMPS}")).contains("timeout_s"));
        let mixed =
            "[lamps]\nleft = [\"l\"]\n[lamps.right]\ndriver = \"command\"\non = [\"r\"]\noff = [\"r0\"]\n";
        assert!(problem(mixed).contains("left and right alike"));
    }

    #[test]
    fn lamps_stay_lit_only_where_that_is_wanted_and_can_be() {
        let lamps = |text: &str| parse(&format!("{CAMERA}{text}"));
        let rig = lamps(&format!("[lamps]\non_exit = \"keep\"\n{LAMPS}")).unwrap();
        assert_eq!((rig.check(), rig.lamps.unwrap().on_exit), (Ok(()), OnExit::Keep));
        assert_eq!(lamps(LAMPS).unwrap().lamps.unwrap().on_exit, OnExit::Dark);
        let (line, problem) = error(&format!("{CAMERA}[lamps]\non_exit = \"lit\"\n{LAMPS}"));
        assert_eq!(line, "on_exit = \"lit\"");
        assert!(problem.contains("unknown variant `lit`, expected `dark` or `keep`"), "{problem}");
        let gpio = LAMPS.replace(
            "driver = \"command\"\non = [\"r\"]\noff = [\"r0\"]",
            "driver = \"gpio\"\nline = { name = \"GPIO17\" }",
        );
        let problem = lamps(&format!("[lamps]\non_exit = \"keep\"\n{gpio}")).unwrap().check().unwrap_err();
        assert!(problem.to_string().contains("on a GPIO line"), "{problem}");
    }

    #[test]
    fn lamps_are_two() {
        let lamps = |left: &str, right: &str| {
            parse(&format!("{CAMERA}[lamps.left]\n{left}\n[lamps.right]\n{right}\n")).unwrap().check()
        };
        let wled = |first: u16, segment: u8| {
            format!(
                "driver = \"wled\"\nurl = \"http://w\"\nsegment = {segment}\nstrip = {{ first = {first}, pixels = 9 }}"
            )
        };
        let gpio = |line: &str| format!("driver = \"gpio\"\nline = {{ name = {line:?} }}");
        let leds = |first: u16| format!("driver = \"leds\"\nstrip = {{ first = {first}, pixels = 9 }}");
        assert_eq!(lamps(&wled(0, 0), &wled(9, 1)), Ok(()));
        assert_eq!(lamps(&gpio("GPIO17"), &gpio("GPIO27")), Ok(()));
        assert_eq!(lamps(&leds(0), &leds(9)), Ok(()));
        for (left, right) in [
            (wled(0, 0), wled(8, 1)),
            (wled(0, 0), wled(9, 0)),
            (gpio("GPIO17"), gpio("GPIO17")),
            (leds(0), leds(5)),
        ] {
            assert!(
                lamps(&left, &right).unwrap_err().to_string().contains("wanted two lamps"),
                "{left} {right}"
            );
        }
    }

    #[test]
    fn a_lamp_that_draws_too_much_is_refused_when_the_file_is_read() {
        let lamps = |duty: f64| {
            let lamp = |side: &str, first: u16| {
                format!(
                    "[lamps.{side}]\ndriver = \"leds\"\nstrip = {{ first = {first}, pixels = 144, duty = {duty} }}\n"
                )
            };
            parse(&format!("{CAMERA}{}{}", lamp("left", 0), lamp("right", 144))).unwrap().check()
        };
        assert_eq!(lamps(0.5), Ok(()));
        let problem = lamps(0.6).unwrap_err().to_string();
        assert!(problem.starts_with("lamps.left: found a strip that draws 5.18 A"), "{problem}");
    }

    /// The files in `rigs/`.
    #[test]
    fn the_rigs_that_come_with_the_program_are_right() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let mut drivers = std::collections::BTreeSet::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let text = std::fs::read_to_string(&path).unwrap();
            let rig: RigFile =
                toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            rig.check().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert!(!rig.is_virtual());
            let written = toml::to_string(&rig).unwrap();
            assert_eq!(toml::from_str::<RigFile>(&written).unwrap(), rig, "{}", path.display());
            drivers
                .extend(written.lines().filter_map(|line| line.strip_prefix("driver = ")).map(str::to_owned));
        }
        let drivers: Vec<_> = drivers.into_iter().collect();
        assert_eq!(
            drivers.join(" "),
            "\"command\" \"gpio\" \"http\" \"leds\" \"mqtt\" \"rpicam\" \"v4l2\" \"wled\" \"ws2812-spi\""
        );
    }

    /// The tent is virtual only so that there are photographs of a plant.
    #[test]
    fn a_recorded_run_is_seen_again_through_a_rig_of_drivers() {
        let greenhouse = Greenhouse::default();
        let folder = tempfile::tempdir().unwrap();
        let start = Duration::ZERO;
        let tent = RigFile::greenhouse(greenhouse.clone(), VisionConfig::default());
        let mut tent = tent.open(3, start).unwrap().rig;
        let (mut seen, mut shots) = (Vec::new(), Vec::new());
        for light in [Light::LEFT, Light::RIGHT, Light::LEFT] {
            seen.push(tent.observe().unwrap());
            shots.push(tent.shot().unwrap().clone());
            let photo = &tent.shot().unwrap().photo;
            std::fs::write(folder.path().join(&photo.name), &photo.bytes).unwrap();
            tent.step(light).unwrap();
        }

        let log = folder.path().join("log.txt");
        let say = |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> {}\"]", log.display());
        let device = |name: &str| {
            format!("on = {}\noff = {}\n", say(&format!("{name} on")), say(&format!("{name} off")))
        };
        let text = format!(
            "period_min = 1e-4\n[camera]\ndriver = \"replay\"\nfolder = {:?}\n[lamps]\npause_s = 0\n\
             [lamps.left]\n{}[lamps.right]\n{}[flash]\nsettle_s = 0\n{}[calibration]\n{}[vision]\ncrop = {{ {} }}\n",
            folder.path(),
            device("left"),
            device("right"),
            device("flash"),
            toml::to_string(&greenhouse.calibration()).unwrap(),
            toml::to_string(&greenhouse.crop()).unwrap().trim().replace('\n', ", "),
        );
        let rig: RigFile = toml::from_str(&text.replace("[base]", "[calibration.base]")).unwrap();
        {
            let mut rig = rig.open(0, start).unwrap().rig;
            assert_eq!(rig.observe().unwrap(), seen[0]);
            rig.step(Light::LEFT).unwrap();
            assert_eq!(rig.observe().unwrap(), seen[1]);
            rig.step(Light::RIGHT).unwrap();
        }
        let log = std::fs::read_to_string(log).unwrap();
        let steps: Vec<&str> = log.lines().collect();
        assert_eq!(
            steps,
            [
                "flash off", // when it is opened
                "flash on",
                "flash off",
                "right off",
                "left on",
                "flash on",
                "flash off",
                "left off",
                "right on",
                "left off",
                "right off", // when it is dropped
            ]
        );

        let mut resumed = rig.open(0, start).unwrap().rig;
        resumed.relive(0, &shots[0], Some(Light::LEFT), 1);
        resumed.relive(1, &shots[1], Some(Light::RIGHT), 2);
        assert_eq!(resumed.observe().unwrap(), seen[2]);
    }

    #[test]
    fn lamps_with_drivers_stand_behind_the_interlock() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let lamp = |name: &str| {
            let say = |state| format!("[\"sh\", \"-c\", \"echo {name} {state} >> {}\"]", log.display());
            format!("[lamps.{name}]\ndriver = \"command\"\non = {}\noff = {}\n", say("on"), say("off"))
        };
        let rig = parse(&format!("{CAMERA}[lamps]\npause_s = 0\n{}{}", lamp("left"), lamp("right"))).unwrap();
        let mut lamps = rig.lamps.unwrap().open(None).unwrap();
        lamps.light(Some(Light::RIGHT)).unwrap();
        lamps.light(Some(Light::LEFT)).unwrap();
        let log = std::fs::read_to_string(log).unwrap();
        assert_eq!(log, "left off\nright on\nright off\nleft on\n");
    }
}
