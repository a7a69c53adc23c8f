//! `tropism make-rig`: a rig file from what somebody has.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use tropism_lab::files::shell_word;
use tropism_lab::make_rig::{CAMERAS, FLASHES, LAMPS, MakeRigPlan, Part};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Make a rig file from what you have: a camera, lamps, a flash
///
/// The file is put together from the commented ones in rigs/: check its numbers. Other drivers, dimmed and coloured lamps, and
/// more than two are written by hand: docs/reference/rig-file.md.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism make-rig --camera ip --camera-at http://192.168.1.61/capture --lamps wled \\\n    \
    --lamps-at http://wled-tent.local --out rig.toml\n  \
    tropism make-rig --camera usb --camera-at /dev/video0 --lamps zigbee --lamps-at west,east \\\n    \
    --flash tasmota --flash-at flash --broker 127.0.0.1 --out rig.toml\n  \
    tropism make-rig --camera raspberry --lamps leds-pi5 --flash relay-pi5 --out rig.toml")]
pub(crate) struct MakeRig {
    /// Kind of the camera
    #[arg(long, value_name = "KIND", value_parser = kinds(&CAMERAS))]
    camera: String,

    /// URL or device of the camera
    #[arg(long, value_name = "ADDRESS")]
    camera_at: Option<String>,

    /// Kind of the lamps
    #[arg(long, value_name = "KIND", value_parser = kinds(&LAMPS))]
    lamps: String,

    /// URL of the lamps' controller, or the names of the left and the right plug
    #[arg(long, value_name = "ADDRESS")]
    lamps_at: Option<String>,

    /// Kind of the flash; without one, photographs are taken in the light that there is
    #[arg(long, value_name = "KIND", value_parser = kinds(&FLASHES))]
    flash: Option<String>,

    /// Name of the plug of the flash
    #[arg(long, value_name = "NAME")]
    flash_at: Option<String>,

    /// Host of the MQTT broker, for plugs
    #[arg(long, value_name = "HOST")]
    broker: Option<String>,

    /// Rig file to write
    #[arg(long, value_name = "rig.toml")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

/// The kinds of a device as values of an option.
fn kinds(parts: &'static [Part]) -> PossibleValuesParser {
    PossibleValuesParser::new(parts.iter().map(|part| PossibleValue::new(part.kind).help(part.about)))
}

impl MakeRig {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = MakeRigPlan {
            camera: self.camera,
            camera_at: self.camera_at,
            lamps: self.lamps,
            lamps_at: self.lamps_at,
            flash: self.flash,
            flash_at: self.flash_at,
            broker: self.broker,
            out: self.out,
            replace: self.force,
        };
        execute_and_print(&plan, shell, |results| {
            let word = shell_word(&results.out);
            format!("wrote {}\nnext: tropism check {word}", results.out.display())
        })
    }
}
