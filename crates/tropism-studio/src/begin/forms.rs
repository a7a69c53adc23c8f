//! The forms that there are, each a command.

use tropism_lab::make_rig::{CAMERAS, FLASHES, LAMPS, kinds};

use crate::found::Kind;

/// What is filled into a field.
pub(super) enum Input {
    /// The place of work of these kinds below the folder of the studio.
    Work(&'static [Kind]),
    /// The place of a file with one of these endings.
    File(&'static [&'static str]),
    /// The place of a folder.
    Folder,
    /// `greenhouse`, or the place of a rig file.
    Rig,
    /// `greedy`, `periodic`, `periodic:TIME`, or the place of a controller's file.
    Controller,
    /// The name of what is made, without this ending.
    Name(&'static str),
    /// An address, or names with commas between them.
    Address,
    /// A whole number from one to the other.
    Whole(u64, u64),
    /// One of these words.
    Word(&'static [&'static str]),
    /// Whether the option is given.
    Flag,
}

/// A field of a form.
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) label: &'static str,
    /// The option that takes the value; an argument without one if it is empty.
    pub(super) option: &'static str,
    pub(super) input: Input,
    pub(super) preset: &'static str,
    pub(super) is_needed: bool,
}

/// A command that a page can begin.
pub(super) struct Form {
    /// Also the command.
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) says: &'static str,
    pub(super) fields: &'static [Field],
}

const fn needed(
    name: &'static str,
    label: &'static str,
    option: &'static str,
    input: Input,
    preset: &'static str,
) -> Field {
    Field { name, label, option, input, preset, is_needed: true }
}

const fn optional(name: &'static str, label: &'static str, option: &'static str, input: Input) -> Field {
    Field { name, label, option, input, preset: "", is_needed: false }
}

const TASK: Field = optional("task", "Task file", "--task", Input::File(&["toml", "json"]));
const SEED: Field = optional("seed", "Seed", "--seed", Input::Whole(0, u64::MAX));

const CAMERA_KINDS: &[&str] = &kinds(&CAMERAS);
const LAMP_KINDS: &[&str] = &kinds(&LAMPS);
const FLASH_KINDS: &[&str] = &kinds(&FLASHES);

pub(super) const FORMS: &[Form] = &[
    Form {
        name: "run",
        title: "Run a controller",
        says: "On a virtual bean in the virtual tent, or on a plant with the rig of a rig file. It begins at once.",
        fields: &[
            needed("controller", "Controller", "--controller", Input::Controller, "greedy"),
            needed("rig", "Rig", "--rig", Input::Rig, "greenhouse"),
            needed("out", "Name of the run", "--out", Input::Name(""), ""),
            TASK,
            optional("steps", "Steps at most", "--steps", Input::Whole(1, 1_000_000)),
            optional(
                "speed",
                "Speed of the virtual tent, times a plant’s",
                "--speed",
                Input::Whole(1, 100_000),
            ),
            SEED,
        ],
    },
    Form {
        name: "study",
        title: "Study",
        says: "The whole paper on virtual plants: beans, model, evolution, unseen beans, report. The small one takes about a minute.",
        fields: &[
            optional("file", "Study file", "", Input::File(&["toml"])),
            optional("quick", "Small", "--quick", Input::Flag),
            needed("out", "Name", "--out", Input::Name(""), ""),
            SEED,
        ],
    },
    Form {
        name: "sweep",
        title: "Sweep",
        says: "Settings of a sweep file over seeds, in one table.",
        fields: &[
            needed("file", "Sweep file", "", Input::File(&["toml"]), ""),
            optional("model", "Model", "--model", Input::File(&["json"])),
            needed("out", "Name", "--out", Input::Name(""), ""),
        ],
    },
    Form {
        name: "fit",
        title: "Fit a model",
        says: "A model of plants from tracks: of the tip, or of the whole stem.",
        fields: &[
            needed("tracks", "Folder of runs or tracks", "", Input::Folder, ""),
            needed("model", "Model", "--kind", Input::Word(&["tip", "stem", "space"]), "tip"),
            needed("out", "Name of the file", "--out", Input::Name(".json"), ""),
        ],
    },
    Form {
        name: "track",
        title: "Track a folder",
        says: "Tip and stem in a folder of photographs. Region and base: Tune vision shows them first.",
        fields: &[
            needed("photographs", "Folder of photographs", "", Input::Folder, ""),
            needed("out", "Name of the file", "--out", Input::Name(".csv"), ""),
        ],
    },
    Form {
        name: "make-rig",
        title: "Make a rig file",
        says: "From the kinds and addresses of camera, lamps and flash. It is written at once; then lamps and camera can be tried by hand, and calibrated.",
        fields: &[
            needed("camera", "Camera", "--camera", Input::Word(CAMERA_KINDS), CAMERA_KINDS[0]),
            optional("camera_at", "Camera: URL, or device", "--camera-at", Input::Address),
            needed("lamps", "Lamps", "--lamps", Input::Word(LAMP_KINDS), LAMP_KINDS[0]),
            optional("lamps_at", "Lamps: URL, or names of left, right", "--lamps-at", Input::Address),
            optional("flash", "Flash", "--flash", Input::Word(FLASH_KINDS)),
            optional("flash_at", "Flash: name of its plug", "--flash-at", Input::Address),
            optional("broker", "MQTT broker, for plugs", "--broker", Input::Address),
            needed("out", "Name of the file", "--out", Input::Name(".toml"), "rig"),
        ],
    },
    Form {
        name: "check",
        title: "Check a rig",
        says: "Lights lamps and flash one after the other and judges by photographs. No run may be going on with them.",
        fields: &[
            needed("rig", "Rig file", "", Input::File(&["toml"]), ""),
            optional("dry", "Switch nothing", "--dry", Input::Flag),
        ],
    },
    Form {
        name: "export",
        title: "Export a run",
        says: "Track, events, photographs and settings with checksums, in one archive.",
        fields: &[
            needed("run", "Run", "", Input::Work(&[Kind::Run]), ""),
            needed("out", "Name of the file", "--out", Input::Name(".tar"), ""),
        ],
    },
    Form {
        name: "timelapse",
        title: "Film of a run",
        says: "The photographs as a film, with lamp, targets and path; MP4 needs ffmpeg.",
        fields: &[
            needed("run", "Run", "", Input::Work(&[Kind::Run]), ""),
            needed("kind", "Kind of film", "", Input::Word(&["gif", "mp4"]), "gif"),
            needed("out", "Name of the file", "--out", Input::Name(""), ""),
        ],
    },
    Form {
        name: "report",
        title: "Report",
        says: "One page with all figures and numbers of a run, evolution, study or comparison.",
        fields: &[
            needed(
                "of",
                "Of",
                "",
                Input::Work(&[
                    Kind::Run,
                    Kind::Evolution,
                    Kind::Study,
                    Kind::Sweep,
                    Kind::Transfer,
                    Kind::Replicates,
                ]),
                "",
            ),
            needed("out", "Name of the file", "--out", Input::Name(".html"), ""),
        ],
    },
];
