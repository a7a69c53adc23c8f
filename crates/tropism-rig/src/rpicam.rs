//! The camera of a Raspberry Pi, by `rpicam-still`: one process for each photograph, because it can hang for ever.
//!
//! Exposure, gain and colour gains are fixed: the plant looks the same by day and night, and nothing has to settle. The
//! metadata of the photograph proves that the settings were applied and that the frame is fresh.
//!
//! # References
//! Raspberry Pi, "Camera software": <https://www.raspberrypi.com/documentation/computers/camera_software.html>.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::photo::Photo;
use tropism::rig::{Camera, RigError};

use crate::child::run;
use crate::seconds::{Seconds, twenty};
use crate::settings::CameraSettings;
use crate::{failed, picture, retry, whole};

/// A camera on the ribbon of a Raspberry Pi.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RpicamCamera {
    /// The program. If it is left out: `rpicam-still`, or its older name `libcamera-still`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
    /// Number of the camera, from 0.
    #[serde(default)]
    pub camera: u8,
    /// Columns, in pixels.
    pub width: u32,
    /// Rows, in pixels.
    pub height: u32,
    /// Exposure, in µs. A multiple of 10 000 where mains lamps flicker at 100 Hz.
    pub shutter_us: u32,
    /// Analogue gain.
    pub gain: f64,
    /// White balance: gains of red and blue.
    pub awb_gains: [f64; 2],
    /// Focus in dioptres, for cameras that have a motor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_position: Option<f64>,
    /// JPEG quality.
    #[serde(default = "ninety_three")]
    pub quality: u8,
    /// Further arguments of the program.
    #[serde(default)]
    pub extra_args: Vec<String>,
    /// Whether the metadata must prove that the settings were applied and that the frame is fresh.
    #[serde(default = "yes")]
    pub verify_metadata: bool,
    /// Folder for the photograph until it is checked; `/dev/shm`, where it exists, if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scratch: Option<PathBuf>,
    /// Seconds after which the program and its children are killed.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
    /// Further attempts after a failure.
    #[serde(default = "retry::two", deserialize_with = "whole::retries")]
    pub retries: u32,
}

const fn ninety_three() -> u8 {
    93
}

const fn yes() -> bool {
    true
}

/// Relative difference between a setting and its metadata: chosen, because sensors quantise exposure and gain.
const TOLERANCE: f64 = 0.02;

/// Largest difference between the clocks of sensor and system, in ns: chosen by hand.
const CLOCK_NS: u64 = 20_000_000;

/// The largest number of a camera; chosen: more than boards have connectors, with multiplexers.
const MAX_CAMERA: u8 = 15;

/// The longest exposure, in µs: that of the sensor IMX477, 670 s, rounded up.
const MAX_SHUTTER_US: u32 = 700_000_000;

impl CameraSettings for RpicamCamera {
    fn check(&self) -> Result<(), String> {
        let Self { width, height, shutter_us, gain, awb_gains, quality, .. } = self;
        if !(16..=16_384).contains(width) || !(16..=16_384).contains(height) {
            return Err(format!("found {width} x {height} pixels, wanted 16 to 16384 each"));
        }
        if self.camera > MAX_CAMERA {
            return Err(format!("found camera = {}, wanted 0 to {MAX_CAMERA}", self.camera));
        }
        if !(1..=MAX_SHUTTER_US).contains(shutter_us) {
            return Err(format!(
                "found shutter_us = {shutter_us}, wanted a fixed exposure of 1 to {MAX_SHUTTER_US}"
            ));
        }
        for (key, value) in [("gain", *gain), ("awb_gains[0]", awb_gains[0]), ("awb_gains[1]", awb_gains[1])]
        {
            if !(value > 0.0 && value <= 64.0) {
                return Err(format!("found {key} = {value}, wanted above 0 and at most 64"));
            }
        }
        if let Some(dioptres) = self.lens_position.filter(|dioptres| !(0.0..=32.0).contains(dioptres)) {
            return Err(format!("found lens_position = {dioptres}, wanted 0 to 32 dioptres"));
        }
        if !(1..=100).contains(quality) {
            return Err(format!("found quality = {quality}, wanted 1 to 100"));
        }
        Ok(())
    }

    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        let program = match &self.program {
            Some(program) => program.clone(),
            None => find_program()?,
        };
        Ok(Box::new(OpenRpicamCamera { settings: self.clone(), program }))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }

    fn retries(&mut self) -> Option<&mut u32> {
        Some(&mut self.retries)
    }
}

impl RpicamCamera {
    /// The command line. `--immediate` skips the preview, which is valid only because exposure, gain and white balance are
    /// fixed.
    fn words(&self, program: &str, photo: &Path, metadata: &Path) -> Vec<String> {
        let Self { camera, width, height, shutter_us, gain, awb_gains: [red, blue], quality, .. } = self;
        let mut words: Vec<String> = [program, "--nopreview", "--immediate"].map(str::to_owned).to_vec();
        let mut set = |name: &str, value: String| words.extend([format!("--{name}"), value]);
        set("camera", camera.to_string());
        set("width", width.to_string());
        set("height", height.to_string());
        set("shutter", format!("{shutter_us}us"));
        set("gain", gain.to_string());
        set("awbgains", format!("{red},{blue}"));
        if let Some(dioptres) = self.lens_position {
            set("autofocus-mode", "manual".to_owned());
            set("lens-position", dioptres.to_string());
        }
        set("thumb", "none".to_owned());
        set("encoding", "jpg".to_owned());
        set("quality", quality.to_string());
        set("metadata", metadata.display().to_string());
        set("metadata-format", "json".to_owned());
        words.extend(self.extra_args.iter().cloned());
        words.extend(["--output".to_owned(), photo.display().to_string()]);
        words
    }

    /// Checks the metadata of a photograph: exposure and gains as set, and taken between `from_ns` and `to_ns` since boot.
    ///
    /// # Errors
    /// What was found in the metadata, and what was wanted.
    pub fn prove(&self, metadata: &[u8], from_ns: u64, to_ns: u64) -> Result<(), String> {
        let said: Metadata = serde_json::from_slice(metadata)
            .map_err(|error| format!("found metadata that is none of rpicam's: {error}"))?;
        for (name, found, wanted) in [
            ("ExposureTime", said.exposure_time, f64::from(self.shutter_us)),
            ("AnalogueGain", said.analogue_gain, self.gain),
            ("ColourGains[0]", said.colour_gains[0], self.awb_gains[0]),
            ("ColourGains[1]", said.colour_gains[1], self.awb_gains[1]),
        ] {
            // NaN fails the comparison.
            let is_near = (found - wanted).abs() <= TOLERANCE * wanted;
            if !is_near {
                return Err(format!("found {name} {found}, wanted {wanted} within 2 %"));
            }
        }
        let taken = said.sensor_timestamp;
        if taken < from_ns.saturating_sub(CLOCK_NS) || taken > to_ns.saturating_add(CLOCK_NS) {
            return Err(format!(
                "found a frame of {:.3} s since the start of the machine, wanted one between {:.3} and {:.3}",
                taken as f64 / 1e9,
                from_ns as f64 / 1e9,
                to_ns as f64 / 1e9
            ));
        }
        Ok(())
    }
}

/// The metadata of rpicam-still that are checked.
#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Metadata {
    /// In µs.
    exposure_time: f64,
    analogue_gain: f64,
    colour_gains: [f64; 2],
    /// Time since boot, in ns.
    sensor_timestamp: u64,
}

/// Finds the program under its present or its older name.
fn find_program() -> Result<String, RigError> {
    let path = env::var_os("PATH").unwrap_or_default();
    let is_there = |name: &str| env::split_paths(&path).any(|folder| folder.join(name).is_file());
    if let Some(name) = ["rpicam-still", "libcamera-still"].into_iter().find(|name| is_there(name)) {
        return Ok(name.to_owned());
    }
    let problem = if is_there("raspistill") {
        "only raspistill is installed, which cannot say what it did: sudo apt install rpicam-apps"
    } else {
        "rpicam-still is not installed: sudo apt install rpicam-apps"
    };
    Err(failed("camera", problem))
}

/// Nanoseconds since boot, including suspend: the clock of the timestamps of frames.
#[cfg(target_os = "linux")]
fn boot_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Boottime);
    // Neither is negative on this clock.
    u64::try_from(now.tv_sec).unwrap_or_default() * 1_000_000_000
        + u64::try_from(now.tv_nsec).unwrap_or_default()
}

/// Other systems have no such camera.
#[cfg(not(target_os = "linux"))]
fn boot_ns() -> u64 {
    0
}

/// An open camera.
pub(crate) struct OpenRpicamCamera {
    settings: RpicamCamera,
    program: String,
}

impl OpenRpicamCamera {
    fn attempt(&self) -> Result<Photo, RigError> {
        let settings = &self.settings;
        let error = |problem: String| failed(format!("camera ({})", self.program), problem);
        let memory = Path::new("/dev/shm");
        let scratch = match &settings.scratch {
            Some(folder) => folder.clone(),
            None if memory.is_dir() => memory.to_owned(),
            None => env::temp_dir(),
        };
        // A new folder for each photograph; removed on return.
        let folder = tempfile::Builder::new()
            .prefix("tropism-")
            .tempdir_in(&scratch)
            .map_err(|cause| error(format!("{}: cannot make a folder: {cause}", scratch.display())))?;
        let (photo, metadata) = (folder.path().join("photo.jpg"), folder.path().join("metadata.json"));
        let from_ns = boot_ns();
        run("camera", &settings.words(&self.program, &photo, &metadata), settings.timeout_s.duration())?;
        let to_ns = boot_ns();
        let read = |path: &Path, what: &str| {
            fs::read(path).map_err(|cause| error(format!("found no {what} when it was done: {cause}")))
        };
        let bytes = read(&photo, "photograph")?;
        picture::check(&bytes).map_err(error)?;
        if settings.verify_metadata {
            settings.prove(&read(&metadata, "metadata")?, from_ns, to_ns).map_err(error)?;
        }
        Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
    }
}

impl Camera for OpenRpicamCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        retry::retry(self.settings.retries, || {
            // A killed program may hold the camera for a short time.
            self.attempt().inspect_err(|_| std::thread::sleep(Duration::from_millis(200)))
        })
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::picture::tests::jpeg;

    const SETTINGS: &str =
        "width = 32\nheight = 24\nshutter_us = 20000\ngain = 1.0\nawb_gains = [2.1, 1.7]\n";

    fn settings(more: &str) -> RpicamCamera {
        let settings: RpicamCamera = toml::from_str(&format!("{SETTINGS}{more}")).unwrap();
        settings.check().unwrap();
        settings
    }

    #[test]
    fn nothing_is_left_to_the_cameras_own_judgement() {
        let words = settings("lens_position = 1.2\nextra_args = [\"--denoise\", \"cdn_off\"]").words(
            "rpicam-still",
            Path::new("/run/p.jpg"),
            Path::new("/run/m.json"),
        );
        assert_eq!(
            words.join(" "),
            "rpicam-still --nopreview --immediate --camera 0 --width 32 --height 24 --shutter 20000us --gain 1 \
             --awbgains 2.1,1.7 --autofocus-mode manual --lens-position 1.2 --thumb none --encoding jpg --quality 93 \
             --metadata /run/m.json --metadata-format json --denoise cdn_off --output /run/p.jpg"
        );
    }

    fn metadata(exposure: f64, gain: f64, red: f64, taken: u64) -> String {
        format!(
            "{{\"ExposureTime\": {exposure}, \"AnalogueGain\": {gain}, \"ColourGains\": [{red}, 1.7], \
             \"SensorTimestamp\": {taken}, \"Lux\": 12.5, \"SensorTemperature\": 31.0}}"
        )
    }

    #[test]
    fn what_the_camera_says_must_fit() {
        let prove = |text: &str| settings("").prove(text.as_bytes(), 5_000_000_000, 6_000_000_000);
        assert_eq!(prove(&metadata(19_990.0, 1.01, 2.1, 5_500_000_000)), Ok(()));
        assert!(
            prove(&metadata(33_000.0, 1.0, 2.1, 5_500_000_000)).unwrap_err().contains("ExposureTime 33000")
        );
        assert!(prove(&metadata(20_000.0, 8.0, 2.1, 5_500_000_000)).unwrap_err().contains("AnalogueGain 8"));
        assert!(
            prove(&metadata(20_000.0, 1.0, 1.5, 5_500_000_000)).unwrap_err().contains("ColourGains[0] 1.5")
        );
        for taken in [4_900_000_000, 6_100_000_000, 0, u64::MAX] {
            let stale = prove(&metadata(20_000.0, 1.0, 2.1, taken)).unwrap_err();
            assert!(stale.contains("wanted one between 5.000 and 6.000"), "{stale}");
        }
        for text in ["", "{}", "[]", "{\"ExposureTime\": null}"] {
            assert!(prove(text).unwrap_err().contains("none of rpicam's"), "{text}");
        }
    }

    /// A program in the place of rpicam-still that does what `script` says; `$photo` and `$metadata` are its files, and
    /// `$now` the time of a frame. The picture it can write is `$picture`.
    fn double(folder: &Path, script: &str, timeout_s: f64) -> Box<dyn Camera> {
        fs::write(folder.join("picture.jpg"), jpeg(3)).unwrap();
        let program = folder.join("rpicam-still");
        let text = format!(
            "#!/bin/sh\nwhile [ $# -gt 0 ]; do case $1 in --output) photo=$2;; --metadata) metadata=$2;; esac; shift; \
             done\npicture={}/picture.jpg\nnow=$(awk '{{printf \"%.0f\", $1 * 1e9}}' /proc/uptime)\n{script}\n",
            folder.display()
        );
        fs::write(&program, text).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let more =
            format!("program = {program:?}\nscratch = {folder:?}\nretries = 0\ntimeout_s = {timeout_s:?}");
        settings(&more).open().unwrap()
    }

    const SAYS: &str = "cat > $metadata <<END\n{\"ExposureTime\": 20000, \"AnalogueGain\": 1, \"ColourGains\": [2.1, \
                        1.7], \"SensorTimestamp\": $now}\nEND\n";

    /// What the camera says after `script`, and whether it left anything behind.
    fn photograph(script: &str, timeout_s: f64) -> Result<Vec<u8>, String> {
        let folder = tempfile::tempdir().unwrap();
        let mut camera = double(folder.path(), script, timeout_s);
        let photo = camera.photograph().map(|photo| photo.bytes).map_err(|error| error.to_string());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "the program and its picture");
        photo
    }

    #[test]
    fn a_photograph_is_whole_and_proven() {
        assert_eq!(photograph(&format!("cp $picture $photo\n{SAYS}"), 20.0).unwrap(), jpeg(3));
    }

    #[test]
    fn a_program_that_hangs_dies_or_writes_half_a_file_gives_no_photograph() {
        // As it does when the device times out: it says so, and tries for ever, in a child.
        let hangs = "echo 'Device timeout detected, attempting a restart!!!' >&2\nsleep 60 &\nwait";
        assert!(photograph(hangs, 0.4).unwrap_err().contains("still runs"));
        let dies =
            photograph("echo 'ERROR: *** failed to acquire camera ***' >&2\nexit 255", 20.0).unwrap_err();
        assert!(dies.contains("255") && dies.contains("failed to acquire camera"), "{dies}");
        let killed = photograph("kill -9 $$", 20.0).unwrap_err();
        assert!(killed.contains("signal"), "{killed}");
        let half = photograph(&format!("head -c 300 $picture > $photo\n{SAYS}"), 20.0).unwrap_err();
        assert!(half.contains("picture is damaged"), "{half}");
        assert!(photograph(SAYS, 20.0).unwrap_err().contains("found no photograph"));
        assert!(photograph("cp $picture $photo", 20.0).unwrap_err().contains("found no metadata"));
        let stale = format!("cp $picture $photo\nnow=$((now - 3000000000))\n{SAYS}");
        assert!(photograph(&stale, 20.0).unwrap_err().contains("wanted one between"));
    }

    #[test]
    fn settings_that_no_camera_has_are_named() {
        for (text, wanted) in [
            (SETTINGS.replace("20000", "0"), "shutter_us = 0"),
            (SETTINGS.replace("1.0", "0"), "gain = 0"),
            (SETTINGS.replace("2.1", "inf"), "awb_gains[0] = inf"),
            (SETTINGS.replace("32", "3"), "3 x 24"),
            (format!("{SETTINGS}quality = 0"), "quality = 0"),
            (format!("{SETTINGS}lens_position = -1"), "lens_position = -1"),
        ] {
            let settings: RpicamCamera = toml::from_str(&text).unwrap();
            let problem = settings.check().unwrap_err();
            assert!(problem.contains(wanted), "{problem}");
        }
    }
}
