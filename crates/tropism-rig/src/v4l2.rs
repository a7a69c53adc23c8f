//! USB cameras and other devices of the kernel's video interface (V4L2). Controls are set and read back, and the first
//! frames are discarded.
//!
//! # References
//! Linux kernel, "Video for Linux API": <https://docs.kernel.org/userspace-api/media/v4l/v4l2.html>.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::photo::{Image, Photo};
use tropism::rig::{Camera, RigError};

use crate::seconds::{Seconds, twenty};
use crate::settings::CameraSettings;
use crate::{failed, retry, whole};

/// Pixel format of a video device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Frames {
    /// JPEG frames, kept unchanged.
    #[default]
    #[serde(rename = "MJPG")]
    Mjpg,
    /// Raw YUV 4:2:2 pixels (BT.601, limited range), kept as JPEG of quality 95.
    #[serde(rename = "YUYV")]
    Yuyv,
}

/// A video device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct V4l2Camera {
    /// The device. A name from `/dev/v4l/by-id` does not change when another camera is plugged in.
    pub device: PathBuf,
    /// Columns, in pixels.
    pub width: u32,
    /// Rows, in pixels.
    pub height: u32,
    /// Pixel format. Nearly every camera has JPEG at all its sizes, and raw pixels at the small ones.
    #[serde(default)]
    pub format: Frames,
    /// Frames that are discarded while the camera settles.
    #[serde(default = "eight", deserialize_with = "whole::frames")]
    pub discard_frames: u32,
    /// Controls and their values, named as by `v4l2-ctl --list-ctrls`. Exposure, gain, white balance and focus should be
    /// fixed: the plant must look the same by day and night.
    #[serde(default)]
    pub controls: BTreeMap<String, i32>,
    /// Time limit of one attempt.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
    /// Further attempts after a failure.
    #[serde(default = "retry::two", deserialize_with = "whole::retries")]
    pub retries: u32,
}

const fn eight() -> u32 {
    8
}

impl CameraSettings for V4l2Camera {
    fn check(&self) -> Result<(), String> {
        let Self { width, height, format, .. } = self;
        if !(16..=16_384).contains(width) || !(16..=16_384).contains(height) {
            return Err(format!("found {width} x {height} pixels, wanted 16 to 16384 each"));
        }
        if *format == Frames::Yuyv && width % 2 == 1 {
            return Err(format!("found {width} columns of YUYV, wanted an even number"));
        }
        Ok(())
    }

    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        Ok(Box::new(self.clone()))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }

    fn retries(&mut self) -> Option<&mut u32> {
        Some(&mut self.retries)
    }

    fn discards_frames(&self) -> bool {
        true
    }
}

impl V4l2Camera {
    fn error(&self, problem: String) -> RigError {
        failed(format!("camera ({})", self.device.display()), problem)
    }

    /// The controls, automatic modes first: other controls are refused or ignored while such a mode is on.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    fn ordered(&self) -> Vec<(&str, i32)> {
        let mut controls: Vec<_> =
            self.controls.iter().map(|(name, &value)| (name.as_str(), value)).collect();
        controls.sort_by_key(|(name, _)| !name.contains("auto"));
        controls
    }
}

/// The name of a control as `v4l2-ctl` writes it: letters and digits, anything else as one `_`.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
fn key(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_").to_ascii_lowercase()
}

/// Converts YUV 4:2:2: two pixels in four bytes (Y, U, Y, V). Rows may be padded.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
fn from_yuyv(bytes: &[u8], width: usize, height: usize, row: usize) -> Result<Image, String> {
    if row < 2 * width || bytes.len() < row * (height - 1) + 2 * width {
        return Err(format!("found a frame of {} bytes, wanted {height} rows of {}", bytes.len(), 2 * width));
    }
    let pixels = bytes.chunks(row).take(height).flat_map(|row| row[..2 * width].as_chunks().0);
    let rgb = pixels.flat_map(|&[first, blue, second, red]: &[u8; 4]| {
        let (blue, red) = (i32::from(blue) - 128, i32::from(red) - 128);
        [first, second].into_iter().flat_map(move |light| {
            let light = 298 * (i32::from(light) - 16);
            [light + 409 * red, light - 100 * blue - 208 * red, light + 516 * blue]
                .map(|part| ((part + 128) >> 8).clamp(0, 255) as u8)
        })
    });
    Ok(Image { width, height, rgb: rgb.collect() })
}

#[cfg(target_os = "linux")]
mod device {
    use std::io;
    use std::thread;
    use std::time::{Duration, Instant};

    use linuxvideo::Device;
    use linuxvideo::controls::Cid;
    use linuxvideo::format::{PixFormat, PixelFormat};

    use super::{Frames, Photo, RigError, V4l2Camera, from_yuyv, key};
    use crate::picture;

    impl V4l2Camera {
        /// Takes one photograph, and closes the device: a camera that streams for days gets hot and hangs.
        pub(super) fn attempt(&self) -> Result<Photo, RigError> {
            let error = |doing: &str| {
                let doing = doing.to_owned();
                move |cause: io::Error| self.error(format!("cannot {doing}: {cause}"))
            };
            let mut device = Device::open(&self.device).map_err(error("open it"))?;
            self.lock(&mut device)?;
            let pixels = match self.format {
                Frames::Mjpg => PixelFormat::MJPG,
                Frames::Yuyv => PixelFormat::YUYV,
            };
            let format = PixFormat::new(self.width, self.height, pixels);
            let capture = device.video_capture(format).map_err(error("set its format"))?;
            let found = capture.format();
            let row = found.bytes_per_line() as usize;
            if (found.width(), found.height(), found.pixel_format()) != (self.width, self.height, pixels) {
                return Err(self.error(format!(
                    "found {} x {} pixels of {}, wanted {} x {} of {pixels}",
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
                        return Err(self.error(format!("no frame in {timeout:?}")));
                    }
                    thread::sleep(Duration::from_millis(5));
                }
                let frame = stream.dequeue(|frame| Ok((frame.is_error(), frame.to_vec())));
                let (is_damaged, bytes) = frame.map_err(error("take a frame"))?;
                if left > 0 {
                    left -= 1;
                } else if !is_damaged {
                    let bytes = self.photograph_of(bytes, row).map_err(|problem| self.error(problem))?;
                    return Ok(Photo { name: String::new(), bytes, time_s: 0.0 });
                } else if Instant::now() >= deadline {
                    return Err(self.error("all frames are damaged".to_owned()));
                }
            }
        }

        /// Converts a frame to the file that is kept.
        fn photograph_of(&self, frame: Vec<u8>, row: usize) -> Result<Vec<u8>, String> {
            match self.format {
                Frames::Mjpg => picture::check(&frame).map(|()| frame),
                Frames::Yuyv => from_yuyv(&frame, self.width as usize, self.height as usize, row)?
                    .to_jpeg(95)
                    .map_err(|problem| problem.to_string()),
            }
        }

        /// Sets all controls, then reads them back: some cameras accept a value and ignore it.
        fn lock(&self, device: &mut Device) -> Result<(), RigError> {
            let listed = device.controls().flatten().map(|control| (key(control.name()), control.id()));
            // The iterator of the driver starts after the first control.
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
    /// V4L2 exists on Linux only.
    fn attempt(&self) -> Result<Photo, RigError> {
        Err(self.error("V4L2 needs Linux".to_owned()))
    }
}

impl Camera for V4l2Camera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        retry::retry(self.retries, || self.attempt())
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
    fn raw_pixels_become_the_colours_they_mean_and_rows_end_where_they_should() {
        // White, black; red, red; and two bytes more than there are pixels.
        let bytes = [235, 128, 16, 128, 7, 7, 81, 90, 81, 240, 7, 7];
        let image = from_yuyv(&bytes, 2, 2, 6).unwrap();
        assert_eq!([image.at(0, 0), image.at(1, 0)], [[255; 3], [0; 3]]);
        for x in 0..2 {
            let [red, green, blue] = image.at(x, 1);
            assert!(red > 250 && green < 5 && blue < 5, "{red} {green} {blue}");
        }
        assert_eq!(from_yuyv(&bytes[..10], 2, 2, 6), Ok(image));
        assert!(from_yuyv(&bytes[..9], 2, 2, 6).unwrap_err().contains("9 bytes, wanted 2 rows of 4"));
        let odd = V4l2Camera { width: 641, ..camera("format = \"YUYV\"") };
        assert!(odd.check().unwrap_err().contains("641 columns"));
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
