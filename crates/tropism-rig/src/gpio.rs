//! A relay on a GPIO line.
//!
//! The chip is found by its label, or the line by its name: chip numbers change with the kernel. The line is requested for
//! as long as the rig is open, so that no other program drives it, and is switched off before it is released. After a kill
//! its state depends on the system, see docs/reference/lamps.md.

use serde::{Deserialize, Serialize};
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::failed;
use crate::seconds::{Seconds, one, ten};
use crate::settings::{FlashSettings, LampSettings, Outlet};
use crate::switch::Switch;

/// A GPIO line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// The label of its chip: `pinctrl-rp1` (Pi 5), `pinctrl-bcm2711` (Pi 4), `pinctrl-bcm2835` (before).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chip: Option<String>,
    /// Its name, such as `GPIO17`, or its number on `chip`.
    pub name: String,
    /// Whether the device is on when the line is low, as most relay boards with optocouplers are.
    #[serde(default)]
    pub active_low: bool,
}

/// A lamp on a relay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GpioLamp {
    /// The relay's line.
    pub line: Line,
}

/// A flash on a relay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GpioFlash {
    /// The relay's line.
    pub line: Line,
    /// Seconds from switching on to the photograph.
    #[serde(default = "one")]
    pub settle_s: Seconds,
    /// Longest time for which the flash is on.
    #[serde(default = "ten")]
    pub max_on_s: Seconds,
}

impl LampSettings for GpioLamp {
    fn check(&self, _period_min: f64) -> Result<(), String> {
        self.line.check()
    }

    fn outlet(&self) -> Outlet {
        self.line.outlet()
    }

    fn dims(&self) -> bool {
        false
    }

    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        self.line.open(device)
    }
}

impl FlashSettings for GpioFlash {
    fn check(&self) -> Result<(), String> {
        self.line.check()
    }

    fn outlet(&self) -> Outlet {
        self.line.outlet()
    }

    fn open(&self, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        self.line.open("flash")
    }

    fn times(&self) -> [Seconds; 2] {
        [self.settle_s, self.max_on_s]
    }
}

impl Line {
    fn outlet(&self) -> Outlet {
        Outlet::Line { chip: self.chip.clone(), name: self.name.clone() }
    }

    fn check(&self) -> Result<(), String> {
        if self.name.is_empty() {
            return Err("line.name is empty: give a name or a number".to_owned());
        }
        if self.chip.is_none() && self.name.parse::<u32>().is_ok() {
            return Err(format!(
                "found line.name = {:?} without a chip, wanted a name such as GPIO17, or the label of the chip",
                self.name
            ));
        }
        Ok(())
    }

    /// The offset of this line among those of a chip, by their names.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    fn offset<'a>(&self, names: impl Iterator<Item = &'a str>) -> Option<u32> {
        let mut names = names.zip(0..);
        match self.name.parse::<u32>() {
            Ok(number) => names.find(|&(_, offset)| offset == number).map(|(_, offset)| offset),
            Err(_) => names.find(|&(name, _)| name == self.name).map(|(_, offset)| offset),
        }
    }

    /// Requests the line, switched off.
    ///
    /// # Errors
    /// [`RigError::Device`] if the line does not exist, or another program holds it.
    #[cfg(target_os = "linux")]
    fn open(&self, device: &str) -> Result<Box<dyn Switch>, RigError> {
        use gpiocdev::line::Value;

        let device =
            format!("{device} (line {} of {})", self.name, self.chip.as_deref().unwrap_or("any chip"));
        let error = |problem: String| failed(device.as_str(), problem);
        let paths = gpiocdev::chip::chips().map_err(|cause| error(cause.to_string()))?;
        let mut labels = Vec::new();
        for path in paths {
            let chip = gpiocdev::Chip::from_path(&path).map_err(|cause| error(cause.to_string()))?;
            let about = chip.info().map_err(|cause| error(cause.to_string()))?;
            let is_it = self.chip.as_ref().is_none_or(|label| *label == about.label);
            labels.push(about.label);
            if !is_it {
                continue;
            }
            let lines = chip.line_info_iter().map_err(|cause| error(cause.to_string()))?;
            let lines: Vec<_> = lines.flatten().collect();
            let Some(offset) = self.offset(lines.iter().map(|line| line.name.as_str())) else { continue };
            let mut request = gpiocdev::Request::builder();
            request.on_chip(&path).with_consumer("tropism").with_line(offset);
            // Inactive from the request on.
            request.as_output(Value::Inactive);
            if self.active_low {
                request.as_active_low();
            }
            let request = request.request().map_err(|cause| {
                let holder = lines.get(offset as usize).map_or("", |line| line.consumer.as_str());
                error(format!("cannot request it: {cause}; {holder:?} holds it"))
            })?;
            return Ok(Box::new(OpenLine { device, request }));
        }
        Err(error(format!("found no such line; chips are {}", labels.join(", "))))
    }

    /// GPIO lines exist on Linux only.
    #[cfg(not(target_os = "linux"))]
    fn open(&self, device: &str) -> Result<Box<dyn Switch>, RigError> {
        Err(failed(device, "GPIO needs Linux"))
    }
}

/// A requested line.
#[cfg(target_os = "linux")]
struct OpenLine {
    device: String,
    request: gpiocdev::Request,
}

#[cfg(target_os = "linux")]
impl Switch for OpenLine {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        use gpiocdev::line::Value;

        let error = |cause: gpiocdev::Error| failed(self.device.as_str(), cause.to_string());
        let value = if is_on { Value::Active } else { Value::Inactive };
        self.request.set_lone_value(value).map_err(error)?;
        let found = self.request.lone_value().map_err(error)?;
        if found == value {
            Ok(())
        } else {
            Err(failed(self.device.as_str(), format!("found the line {found}, wanted it {value}")))
        }
    }

    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        use tropism::lighting::FULL;

        match level {
            0 | FULL => self.switch(level == FULL),
            _ => Err(crate::switch::cannot_dim(&self.device, level)),
        }
    }
}

#[cfg(target_os = "linux")]
impl Drop for OpenLine {
    fn drop(&mut self) {
        // The system may keep the level of a released line. A failure cannot be reported here.
        let _ = self.switch(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Line {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn lines_have_names_or_numbers_on_a_chip() {
        let names = ["ID_SDA", "ID_SCL", "GPIO2", "GPIO3"];
        let offset = |text: &str| line(text).offset(names.into_iter());
        assert_eq!(offset("name = \"GPIO3\""), Some(3));
        assert_eq!(offset("name = \"GPIO4\""), None);
        assert_eq!(offset("chip = \"pinctrl-rp1\"\nname = \"2\""), Some(2));
        assert_eq!(offset("chip = \"pinctrl-rp1\"\nname = \"17\""), None);
        assert!(line("name = \"17\"").check().unwrap_err().contains("without a chip"));
        assert!(line("name = \"\"").check().unwrap_err().contains("empty"));
        line("name = \"17\"\nchip = \"pinctrl-rp1\"").check().unwrap();
    }

    #[test]
    fn a_line_that_is_not_there_is_named_with_the_chips_that_are() {
        let error =
            line("chip = \"no-such-chip\"\nname = \"GPIO17\"").open("flash").err().unwrap().to_string();
        assert!(error.contains("flash") && error.contains("found no"), "{error}");
    }
}
