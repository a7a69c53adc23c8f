//! A USB camera, or whatever else the kernel's video interface has: its controls set and read back, its first frames
//! thrown away.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::photo::Photo;
use tropism::rig::{Camera, RigError};

use crate::seconds::{Seconds, twenty};
use crate::{failed, tries};

/// A video device that gives JPEG pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct V4l2Camera {
    /// The device. A name from `/dev/v4l/by-id` stays the camera's when another one is plugged in.
    pub device: PathBuf,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames that are thrown away while the camera settles.
    #[serde(default = "eight")]
    pub discard_frames: u32,
    /// Controls and their values, named as by `v4l2-ctl --list-ctrls`. Exposure, gain, white balance and focus should be
    /// fixed: the plant must look the same by day and night.
    #[serde(default)]
    pub controls: BTreeMap<String, i32>,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
    /// Further tries if a photograph fails.
    #[serde(default = "tries::two")]
    pub retries: u32,
}

const fn eight() -> u32 {
    8
}

impl V4l2Camera {
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { width, height, .. } = self;
        if !(16..=16_384).contains(width) || !(16..=16_384).contains(height) {
            return Err(format!("found {width} x {height} pixels, wanted 16 to 16384 each"));
        }
        Ok(())
    }

    fn error(&self, problem: String) -> RigError {
        failed(format!("camera ({})", self.device.display()), problem)
    }

    /// The controls with those first that switch an automatism: others are refused or ignored while it is on.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    fn ordered(&self) -> Vec<(&str, i32)> {
        let mut controls: Vec<_> =
            self.controls.iter().map(|(name, &value)| (name.as_str(), value)).collect();
        controls.sort_by_key(|(name, _)| !name.contains("auto"));
        controls
    }
}

/// The name of a control as `v4l2-ctl` writes it: letters and digits, the rest one `_`.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
fn key(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_").to_ascii_lowercase()
}

#[cfg(target_os = "linux")]
mod device {
    use std::io;
    use std::thread;
    use std::time::{Duration, Instant};

    use linuxvideo::Device;
    use linuxvideo::controls::Cid;
    use linuxvideo::format::{PixFormat, PixelFormat};

    use super::{Photo, RigError, V4l2Camera, key};
    use crate::picture;

    impl V4l2Camera {
        /// One photograph; the device is closed again, for a camera that streams for days gets hot and hangs.
        pub(super) fn attempt(&self) -> Result<Photo, RigError> {
            let error = |doing: &str| {
                let doing = doing.to_owned();
                move |cause: io::Error| self.error(format!("cannot {doing}: {cause}"))
            };
            let mut device = Device::open(&self.device).map_err(error("open it"))?;
            self.lock(&mut device)?;
            let format = PixFormat::new(self.width, self.height, PixelFormat::MJPG);
            let capture = device.video_capture(format).map_err(error("set the format MJPG"))?;
            let found = capture.format();
            if (found.width(), found.height(), found.pixel_format())
                != (self.width, self.height, PixelFormat::MJPG)
            {
                return Err(self.error(format!(
                    "found {} x {} pixels of {:?}, wanted {} x {} of MJPG",
                    found.width(),
                    found.height(),
                    found.pixel_format(),
                    self.width,
                    self.height
                )));
            }
            let deadline = Instant::now() + self.timeout_s.duration();
            let mut stream = capture.into_stream().map_err(error("start its stream"))?;
            let mut left = self.discard_frames;
            loop {
                while stream.will_block().map_err(error("ask for a frame"))? {
                    if Instant::now() >= deadline {
                        let timeout = self.timeout_s.duration();
                        return Err(self.error(format!("found no frame in {timeout:?}, wanted one")));
                    }
                    thread::sleep(Duration::from_millis(5));
                }
                let frame = stream.dequeue(|frame| Ok((frame.is_error(), frame.to_vec())));
                let (is_damaged, bytes) = frame.map_err(error("take a frame"))?;
                if left > 0 {
                    left -= 1;
                } else if !is_damaged {
                    picture::check(&bytes).map_err(|problem| self.error(problem))?;
                    return Ok(Photo { name: String::new(), bytes, time_s: 0.0 });
                } else if Instant::now() >= deadline {
                    return Err(self.error("found only damaged frames, wanted a whole one".to_owned()));
                }
            }
        }

        /// Sets the controls, and reads them all back once they are set: some cameras take a value and ignore it.
        fn lock(&self, device: &mut Device) -> Result<(), RigError> {
            let listed = device.controls().flatten().map(|control| (key(control.name()), control.id()));
            // The list goes from one control to the next and leaves out the very first.
            let known: Vec<_> =
                std::iter::once(("brightness".to_owned(), Cid::BRIGHTNESS)).chain(listed).collect();
            let find = |name: &str| {
                let names = || known.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
                let control = known.iter().find(|(known, _)| known == name);
                control
                    .map(|&(_, id)| id)
                    .ok_or_else(|| self.error(format!("found no control {name}, wanted one of {}", names())))
            };
            for (name, value) in self.ordered() {
                device
                    .write_control_raw(find(name)?, value)
                    .map_err(|cause| self.error(format!("cannot set {name} to {value}: {cause}")))?;
            }
            for (name, wanted) in self.ordered() {
                let found = device
                    .read_control_raw(find(name)?)
                    .map_err(|cause| self.error(format!("cannot read {name}: {cause}")))?;
                if found != wanted {
                    return Err(self.error(format!("found {name} = {found}, wanted {wanted}")));
                }
            }
            Ok(())
        }
    }
}

#[cfg(not(target_os = "linux"))]
impl V4l2Camera {
    /// There are such devices on Linux only.
    fn attempt(&self) -> Result<Photo, RigError> {
        Err(self.error("found no V4L2, wanted Linux".to_owned()))
    }
}

impl Camera for V4l2Camera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        tries::again(self.retries, || self.attempt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(text: &str) -> V4l2Camera {
        toml::from_str(&format!("device = \"/no/such/video\"\nwidth = 1920\nheight = 1080\n{text}")).unwrap()
    }

    #[test]
    fn controls_have_the_names_that_v4l2_ctl_shows_and_automatisms_come_first() {
        assert_eq!(key("Exposure Time, Absolute"), "exposure_time_absolute");
        assert_eq!(key("White Balance, Automatic"), "white_balance_automatic");
        let camera = camera(
            "controls = { exposure_time_absolute = 250, auto_exposure = 1, gain = 0, focus_automatic_continuous = 0 }",
        );
        let names: Vec<_> = camera.ordered().into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["auto_exposure", "focus_automatic_continuous", "exposure_time_absolute", "gain"]);
    }

    #[test]
    fn a_device_that_is_not_there_is_named() {
        let error = camera("").photograph().unwrap_err().to_string();
        assert!(error.contains("camera (/no/such/video)"), "{error}");
        let mut flat = camera("");
        flat.height = 0;
        assert!(flat.check().unwrap_err().contains("1920 x 0"));
    }
}
