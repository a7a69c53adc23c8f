//! A rig file from what somebody has: a camera, lamps, a flash.
//!
//! In: their kinds and addresses. Out: a rig file put together from sections of the commented ones in `rigs/`. It has no
//! calibration: that wants a photograph.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism_rig::file::RigFile;

use crate::files;
use crate::{Error, Monitor, Workflow};

/// What there is, and where to write its rig file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MakeRigPlan {
    /// Kind of the camera: `ip`, `usb` or `raspberry`.
    pub camera: String,
    /// Address of the camera: the URL of a photograph (`ip`), or a device such as `/dev/video0` (`usb`).
    pub camera_at: Option<String>,
    /// Kind of the lamps: `wled`, `zigbee`, `leds-pi5` or `spi-pi4`.
    pub lamps: String,
    /// Addresses of the lamps: the URL of the controller (`wled`), or the names of the left and the right plug, with a comma
    /// between them (`zigbee`).
    pub lamps_at: Option<String>,
    /// Kind of the flash: `tasmota`, `zigbee`, `relay-pi4` or `relay-pi5`. Without one, photographs are taken in the light that
    /// there is.
    pub flash: Option<String>,
    /// Name of the plug of the flash (`tasmota`, `zigbee`).
    pub flash_at: Option<String>,
    /// Host of the MQTT broker, for plugs.
    pub broker: Option<String>,
    /// The rig file.
    pub out: PathBuf,
    /// Whether to replace a file at `out`.
    pub replace: bool,
}

impl Default for MakeRigPlan {
    fn default() -> Self {
        Self {
            camera: CAMERAS[0].kind.to_owned(),
            camera_at: None,
            lamps: LAMPS[0].kind.to_owned(),
            lamps_at: None,
            flash: None,
            flash_at: None,
            broker: None,
            out: PathBuf::from("rig.toml"),
            replace: false,
        }
    }
}

/// A rig file that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MakeRigResults {
    /// The rig file.
    pub out: PathBuf,
    /// Its text.
    pub text: String,
}

const WLED: &str = include_str!("make_rig/wled-ipcam.toml");
const PLUGS: &str = include_str!("make_rig/webcam-plugs.toml");
const PI4: &str = include_str!("make_rig/pi4-spi.toml");
const PI5: &str = include_str!("make_rig/pi5-leds.toml");

/// A kind of device: a section of a commented rig file.
#[derive(Debug)]
pub struct Part {
    /// The word for it.
    pub kind: &'static str,
    /// What it is.
    pub about: &'static str,
    file: &'static str,
    /// What stands in the file where its owner writes addresses.
    places: &'static [&'static str],
    /// What its address looks like.
    address: &'static str,
}

const PLUG_NAMES: &str = "two names such as lamp-left,lamp-right";

/// The kinds of cameras.
pub const CAMERAS: [Part; 3] = [
    Part {
        kind: "ip",
        about: "answers over HTTP: ESP32-CAM, mjpg-streamer, Home Assistant",
        file: WLED,
        places: &["http://192.168.1.61/capture"],
        address: "a URL such as http://192.168.1.61/capture",
    },
    Part {
        kind: "usb",
        about: "USB camera of this computer",
        file: PLUGS,
        places: &["/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920-video-index0"],
        address: "a device such as /dev/video0",
    },
    Part { kind: "raspberry", about: "camera of a Raspberry Pi", file: PI5, places: &[], address: "" },
];

/// The kinds of lamps.
pub const LAMPS: [Part; 4] = [
    Part {
        kind: "wled",
        about: "two strips of 144 pixels in a row at one WLED controller",
        file: WLED,
        places: &["http://wled-tent.local"],
        address: "a URL such as http://wled-tent.local",
    },
    Part {
        kind: "zigbee",
        about: "two plugs of zigbee2mqtt",
        file: PLUGS,
        places: &["lamp-left", "lamp-right"],
        address: PLUG_NAMES,
    },
    Part { kind: "leds-pi5", about: "two strips at a Raspberry Pi 5", file: PI5, places: &[], address: "" },
    Part {
        kind: "spi-pi4",
        about: "a chain of strips at a Raspberry Pi 3 or 4",
        file: PI4,
        places: &[],
        address: "",
    },
];

/// The kinds of flashes.
pub const FLASHES: [Part; 4] = [
    Part {
        kind: "tasmota",
        about: "plug with Tasmota",
        file: WLED,
        places: &["flash"],
        address: "a name such as flash",
    },
    Part {
        kind: "zigbee",
        about: "plug of zigbee2mqtt",
        file: PLUGS,
        places: &["flash"],
        address: "a name such as flash",
    },
    Part {
        kind: "relay-pi4",
        about: "relay at GPIO 17 of a Raspberry Pi 3 or 4",
        file: PI4,
        places: &[],
        address: "",
    },
    Part {
        kind: "relay-pi5",
        about: "relay at GPIO 17 of a Raspberry Pi 5",
        file: PI5,
        places: &[],
        address: "",
    },
];

/// The words for these kinds.
///
/// ```
/// use tropism_lab::make_rig::{CAMERAS, kinds};
/// assert_eq!(kinds(&CAMERAS), ["ip", "usb", "raspberry"]);
/// ```
#[must_use]
pub const fn kinds<const N: usize>(parts: &[Part; N]) -> [&'static str; N] {
    let mut kinds = [""; N];
    let mut next = 0;
    while next < N {
        kinds[next] = parts[next].kind;
        next += 1;
    }
    kinds
}

/// The section `name` of the rig file `text`, with the tables below it.
fn section<'a>(text: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let mut is_in = false;
    let heads = [format!("[{name}]"), format!("[{name}.")];
    text.lines().filter(move |line| {
        if line.starts_with('[') {
            is_in = heads.iter().any(|head| line.starts_with(head));
        }
        is_in
    })
}

impl Part {
    /// The section `key` of a device of one of the kinds `all`, with its addresses.
    ///
    /// # Errors
    /// [`Error::Plan`] if there is no such kind, or its addresses are missing or too many.
    fn section_of<const N: usize>(
        all: &[Self; N],
        key: &str,
        kind: &str,
        address: Option<&str>,
    ) -> Result<String, Error> {
        let part = all.iter().find(|part| part.kind == kind).ok_or_else(|| {
            Error::Plan(format!("found `{key}` {kind:?}, wanted one of {}", kinds(all).join(", ")))
        })?;
        let found: Vec<&str> = address.into_iter().flat_map(|all| all.split(',')).map(str::trim).collect();
        if found.len() != part.places.len() || found.contains(&"") {
            let wanted = if part.places.is_empty() { "none" } else { part.address };
            let found = address.map_or_else(|| "none".to_owned(), |address| format!("{address:?}"));
            return Err(Error::Plan(format!(
                "`{key}_at`, the address of `{key}` {kind:?}: found {found}, wanted {wanted}"
            )));
        }
        let mut text = section(part.file, key).collect::<Vec<_>>().join("\n").trim_end().to_owned();
        for (place, found) in part.places.iter().zip(found) {
            text = text.replace(&format!("\"{place}\""), &toml::Value::from(found).to_string());
        }
        Ok(text + "\n")
    }
}

impl MakeRigPlan {
    /// The rig file.
    fn text(&self) -> Result<String, Error> {
        let mut sections = vec![
            Part::section_of(&CAMERAS, "camera", &self.camera, self.camera_at.as_deref())?,
            Part::section_of(&LAMPS, "lamps", &self.lamps, self.lamps_at.as_deref())?,
        ];
        match &self.flash {
            Some(flash) => {
                sections.push(Part::section_of(&FLASHES, "flash", flash, self.flash_at.as_deref())?)
            }
            None if self.flash_at.is_some() => {
                return Err(Error::Plan("`flash_at` is given without `flash`".to_owned()));
            }
            None => {}
        }
        let has_plugs = sections.iter().any(|section| section.contains("driver = \"mqtt\""));
        match &self.broker {
            Some(broker) if has_plugs => {
                sections.push(format!("[mqtt]\nhost = {}\n", toml::Value::from(&**broker)))
            }
            None if !has_plugs => {}
            found => {
                let [found, wanted] = match found {
                    Some(_) => ["one", "none: nothing of this rig is a plug"],
                    None => ["none", "the host of the MQTT broker, for plugs"],
                };
                return Err(Error::Plan(format!("`broker`: found {found}, wanted {wanted}")));
            }
        }
        let head = "# Camera, lamps and flash of a tent, from `tropism make-rig`. Next: tropism check of this file, then a photograph and\n\
                    # tropism calibrate-camera, whose [calibration] belongs here. docs/tutorials/rig.md has all steps.\n\n\
                    durability = \"full\"\nperiod_min = 5.0              # the paper's\n";
        Ok(format!("{head}\n{}", sections.join("\n")))
    }
}

impl Workflow for MakeRigPlan {
    type Results = MakeRigResults;

    const SCHEMA: &'static str = "tropism.make-rig/1";

    fn check(&self) -> Result<(), Error> {
        let rig: RigFile = files::parse_toml(&self.out, &self.text()?)?;
        rig.check().map_err(Error::at(self.out.display()))?;
        files::check_free(&self.out, self.replace)
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<MakeRigResults, Error> {
        let text = self.text()?;
        files::write(&self.out, text.as_bytes())?;
        Ok(MakeRigResults { out: self.out.clone(), text })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Silent;

    fn addressed(part: &Part) -> Option<String> {
        (!part.places.is_empty()).then(|| part.places.join(","))
    }

    #[test]
    fn every_camera_goes_with_every_lamp_and_every_flash() {
        let folder = tempfile::tempdir().unwrap();
        let flashes = FLASHES.iter().map(Some).chain([None]);
        for (camera, lamps, flash) in flashes.flat_map(|flash| {
            CAMERAS.iter().flat_map(move |camera| LAMPS.iter().map(move |lamps| (camera, lamps, flash)))
        }) {
            let is_plug = |kind: &str| ["zigbee", "tasmota"].contains(&kind);
            let has_plugs = is_plug(lamps.kind) || flash.is_some_and(|flash| is_plug(flash.kind));
            let plan = MakeRigPlan {
                camera: camera.kind.to_owned(),
                camera_at: addressed(camera),
                lamps: lamps.kind.to_owned(),
                lamps_at: addressed(lamps),
                flash: flash.map(|flash| flash.kind.to_owned()),
                flash_at: flash.and_then(addressed),
                broker: has_plugs.then(|| "broker.local".to_owned()),
                out: folder.path().join("rig.toml"),
                replace: true,
            };
            plan.execute(&Silent).unwrap_or_else(|error| panic!("{plan:?}: {error}"));
            let rig = crate::run::read_rig(&plan.out).unwrap();
            assert_eq!((rig.flash.is_some(), rig.mqtt.is_some()), (flash.is_some(), has_plugs));
        }
    }

    #[test]
    fn addresses_stand_where_they_belong() {
        let plan = MakeRigPlan {
            camera_at: Some("http://cam/x?a=\"1\"".to_owned()),
            lamps: "zigbee".to_owned(),
            lamps_at: Some("west, east".to_owned()),
            broker: Some("10.0.0.7".to_owned()),
            ..MakeRigPlan::default()
        };
        let table: toml::Table = plan.text().unwrap().parse().unwrap();
        assert_eq!(table["camera"]["url"].as_str(), Some("http://cam/x?a=\"1\""));
        assert_eq!(table["lamps"]["left"]["plug"]["name"].as_str(), Some("west"));
        assert_eq!(table["lamps"]["right"]["plug"]["name"].as_str(), Some("east"));
        assert_eq!(table["mqtt"]["host"].as_str(), Some("10.0.0.7"));
    }

    #[test]
    fn what_is_missing_or_too_much_is_named() {
        let right = MakeRigPlan {
            camera_at: Some("http://192.168.1.61/capture".to_owned()),
            lamps_at: Some("http://wled-tent.local".to_owned()),
            ..MakeRigPlan::default()
        };
        let text = |plan: &MakeRigPlan| plan.check().unwrap_err().to_string();
        for (change, wanted) in [
            (
                |plan: &mut MakeRigPlan| plan.camera = "film".to_owned(),
                "`camera` \"film\", wanted one of ip, usb, raspberry",
            ),
            (|plan: &mut MakeRigPlan| plan.camera_at = None, "found none, wanted a URL such as"),
            (|plan: &mut MakeRigPlan| plan.camera_at = Some("cam".to_owned()), "url"),
            (|plan: &mut MakeRigPlan| plan.lamps_at = Some("http://a,http://b".to_owned()), "`lamps_at`"),
            (|plan: &mut MakeRigPlan| plan.lamps = "spi-pi4".to_owned(), "wanted none"),
            (|plan: &mut MakeRigPlan| plan.flash = Some("zigbee".to_owned()), "`flash_at`"),
            (|plan: &mut MakeRigPlan| plan.flash_at = Some("flash".to_owned()), "without `flash`"),
            (|plan: &mut MakeRigPlan| plan.broker = Some("b".to_owned()), "nothing of this rig is a plug"),
        ] as [(fn(&mut MakeRigPlan), &str); 8]
        {
            let mut plan = right.clone();
            change(&mut plan);
            assert!(text(&plan).contains(wanted), "{plan:?}: {}", text(&plan));
        }
    }
}
