//! Rig files: what is read, refused, written and opened.

use std::time::Duration;

use tropism::environment::Environment;
use tropism::lamps::{Layout, Light};
use tropism::rig::OnExit;

use tropism::vision::VisionConfig;
use tropism_bean::tent::Greenhouse;
use tropism_rig::file::RigFile;

/// The required part of a rig file beside its devices.
const REST: &str =
    "[calibration]\npx_per_cm = 35.0\nwidth = 2592\nheight = 1944\nbase = { x = 1296.0, y = 1700.0 }\n";

fn parse(text: &str) -> Result<RigFile, toml::de::Error> {
    toml::from_str(&format!("{text}{REST}"))
}

/// The line of an error, and its message.
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
    let pair =
        parse(&format!("{CAMERA}[lamps]\nleft = [\"l\"]\nright = [\"r\"]\ndark = [\"d\"]\ntimeout_s = 3\n"));
    let pair = pair.unwrap();
    pair.check().unwrap();
    assert_eq!(toml::from_str::<RigFile>(&toml::to_string(&pair).unwrap()).unwrap(), pair);
}

#[test]
fn an_error_in_the_table_of_a_driver_has_its_line_if_the_driver_comes_first() {
    let (line, problem) = error("[camera]\ndriver = \"command\"\ncomand = [\"x\"]\n");
    assert!(line == "comand = [\"x\"]" && problem.contains("unknown field `comand`"), "{line}: {problem}");
    let (line, problem) = error("[camera]\ndriver = \"command\"\ncommand = [\"x\"]\ntimeout_s = -1\n");
    assert!(line == "timeout_s = -1" && problem.contains("wanted 0 to 3600 seconds"), "{line}: {problem}");
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
    let problem = |lamps: &str| parse(&format!("{CAMERA}{lamps}")).unwrap().check().unwrap_err().to_string();
    let pair = "[lamps]\nleft = [\"l\"]\nright = [\"r\"]\n";
    assert!(problem(pair).contains("there is no `dark`"));
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
            lamps(&left, &right).unwrap_err().to_string().contains("on the same pixels, line or plug"),
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
        let is_four = path.file_name().unwrap() == "wled-four-lamps.toml";
        let layout = if is_four { Layout::four_sides() } else { Layout::wahby2016() };
        assert_eq!(rig.layout().unwrap(), layout, "{}", path.display());
        let written = toml::to_string(&rig).unwrap();
        assert_eq!(toml::from_str::<RigFile>(&written).unwrap(), rig, "{}", path.display());
        drivers.extend(written.lines().filter_map(|line| line.strip_prefix("driver = ")).map(str::to_owned));
    }
    let drivers: Vec<_> = drivers.into_iter().collect();
    assert_eq!(
        drivers.join(" "),
        "\"command\" \"gpio\" \"http\" \"leds\" \"mqtt\" \"rpicam\" \"v4l2\" \"wled\" \"ws2812-spi\""
    );
}

#[test]
fn a_programme_is_written_as_it_is_read_and_one_that_cannot_be_is_refused() {
    let part = |keys: &str| format!("[[programme]]\nfrom = \"06:00\"\nto = \"22:00\"\n{keys}\n");
    let any = "[lamps]\nallowed = { any = { most_lit = 2, budget = 1.5 } }\n";
    let level = LAMPS.replacen("[\"l\"]", "[\"l\", \"{level}\"]", 1);
    let rig = format!(
        "time_zone = \"Europe/Berlin\"\n{}{CAMERA}{any}{level}",
        part("base = \"left:9\"\nramp_min = 30")
    );
    let rig = parse(&rig).unwrap();
    rig.check().unwrap();
    let text = toml::to_string(&rig).unwrap();
    assert_eq!(toml::from_str::<RigFile>(&text).unwrap(), rig, "{text}");

    let problem = |text: &str| parse(text).unwrap().check().unwrap_err().to_string();
    let utc = "time_zone = \"UTC\"\n";
    for (text, wanted) in [
        (
            format!("{utc}{}{CAMERA}{LAMPS}", part("base = \"left\"")),
            "with the steered lamp right: found 2 lit lamps",
        ),
        (
            format!("{utc}{}{CAMERA}{any}{LAMPS}", part("base = \"top:3\"")),
            "found light \"top\", wanted left, right",
        ),
        (
            format!("{utc}{}{CAMERA}{any}{LAMPS}", part("base = \"right:3\"")),
            "programme: found a base light of right with levels, wanted a driver that dims",
        ),
        (
            format!(
                "{utc}{}{CAMERA}{any}{}",
                part("base = \"left:200\""),
                level.replace("[\"r\"]", "[\"{level}\"]")
            ),
            "with the steered lamp right: found a power of 1.78 full lamps, wanted at most 1.5",
        ),
        (format!("time_zone = \"Berlin\"\n{}{CAMERA}{LAMPS}", part("")), "found time_zone = \"Berlin\""),
    ] {
        let found = problem(&text);
        assert!(found.contains(wanted), "{found}");
    }
    let (line, problem) = error(&format!("{}{CAMERA}{LAMPS}", part("").replace("22:00", "25:00")));
    assert!(
        line == "to = \"25:00\"" && problem.contains("wanted \"00:00\" to \"24:00\""),
        "{line}: {problem}"
    );
    let tent = format!("{utc}[greenhouse]\n[[programme]]\nfrom = \"06:00\"\nto = \"22:00\"\n");
    let problem = toml::from_str::<RigFile>(&tent).unwrap().check().unwrap_err().to_string();
    assert!(problem.contains("wanted greenhouse.begins"), "{problem}");
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
    let device =
        |name: &str| format!("on = {}\noff = {}\n", say(&format!("{name} on")), say(&format!("{name} off")));
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
    resumed.replay(0, &shots[0], Some(Light::LEFT), 1);
    resumed.replay(1, &shots[1], Some(Light::RIGHT), 2);
    assert_eq!(resumed.observe().unwrap(), seen[2]);
}

#[test]
fn lamps_with_drivers_stand_behind_the_interlock() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let rig = logged_lamps(&log, "", &["left", "right"]);
    let mut lamps = rig.lamps.unwrap().open(None).unwrap();
    lamps.light(Some(Light::RIGHT)).unwrap();
    lamps.light(Some(Light::LEFT)).unwrap();
    let log = std::fs::read_to_string(log).unwrap();
    assert_eq!(log, "left off\nright on\nright off\nleft on\n");
}

/// A rig of lamps behind programs that write their name and state to `log`.
fn logged_lamps(log: &std::path::Path, settings: &str, names: &[&str]) -> RigFile {
    let lamp = |name: &&str| {
        let say = |state| format!("[\"sh\", \"-c\", \"echo {name} {state} >> {}\"]", log.display());
        format!("[lamps.{name}]\ndriver = \"command\"\non = {}\noff = {}\n", say("on"), say("off"))
    };
    let lamps: String = names.iter().map(lamp).collect();
    parse(&format!("{CAMERA}[lamps]\npause_s = 0\n{settings}{lamps}")).unwrap()
}

#[test]
fn lamps_of_any_names_and_places_are_lit_one_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let names = ["back", "top", "left", "right", "front"];
    let rig = logged_lamps(&log, "at = { top = [0, 80, 0.5], back = [0, 20, -30] }\n", &names);
    rig.check().unwrap();
    let layout = rig.layout().unwrap();
    let found: Vec<_> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
    assert_eq!(found, ["left", "right", "front", "back", "top"]);
    assert_eq!(layout.lamps()[4].at, [0.0, 80.0, 0.5]);
    assert_eq!(layout.lamps()[3].at, [0.0, 20.0, -30.0]);
    assert_eq!(layout.lamps()[..3], Layout::four_sides().lamps()[..3]);
    let text = toml::to_string(&rig).unwrap();
    assert_eq!(toml::from_str::<RigFile>(&text).unwrap(), rig, "{text}");

    let mut rig = rig.open(0, Duration::ZERO).unwrap().rig;
    assert_eq!(rig.layout(), &layout);
    rig.step(layout.parse("top").unwrap().unwrap()).unwrap();
    rig.step(layout.parse("front").unwrap().unwrap()).unwrap();
    drop(rig);
    let log = std::fs::read_to_string(log).unwrap();
    let steps: Vec<_> = log.split_inclusive("on\n").map(|step| step.trim().replace('\n', ", ")).collect();
    assert_eq!(
        steps,
        [
            "left off, right off, front off, back off, top on",
            "left off, right off, back off, top off, front on",
            "left off, right off, front off, back off, top off",
        ]
    );
}

#[test]
fn lamps_without_a_place_and_places_without_a_lamp_are_refused_by_name() {
    let problem = |settings: &str, names: &[&str]| {
        let rig = logged_lamps(std::path::Path::new("/no"), settings, names);
        assert_eq!(rig.check().unwrap_err(), rig.layout().unwrap_err());
        rig.check().unwrap_err().to_string()
    };
    assert!(problem("", &["left"]).contains("found 1 lamps, wanted 2 to 16"));
    let top = problem("", &["left", "top"]);
    assert!(top.starts_with("lamps.top: it needs a place, at = { top = [x, y, z] }"), "{top}");
    let floor = problem("at = { floor = [0, 1, 2] }\n", &["left", "right"]);
    assert!(floor.contains("lamps.at: floor is no lamp of [lamps]"), "{floor}");
    assert!(problem("", &["left", "-right-left-front-back-far-away"]).contains("it needs a place"));
    let (line, message) = error(&format!("{CAMERA}[lamps]\npause = 1\n"));
    assert_eq!(line, "pause = 1");
    assert!(
        message.contains("expected a lamp (a table with a driver, or the words of a program)"),
        "{message}"
    );
    let (line, _) = error(&format!("{CAMERA}[lamps]\nat = {{ top = [0, 1] }}\n"));
    assert_eq!(line, "at = { top = [0, 1] }");
}

#[test]
fn each_of_four_lamps_may_be_a_program() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let program = |name: &&str| format!("{name} = [\"sh\", \"-c\", \"echo {name} >> {}\"]\n", log.display());
    let programs: String = ["front", "left", "right", "back", "dark"].iter().map(program).collect();
    let rig = parse(&format!("{CAMERA}[lamps]\n{programs}")).unwrap();
    rig.check().unwrap();
    let mut lamps = rig.lamps.unwrap().open(None).unwrap();
    for light in [Some(Light::LEFT), Some(Light::RIGHT), Some(Light::FRONT), Some(Light::BACK), None] {
        lamps.light(light).unwrap();
    }
    assert_eq!(std::fs::read_to_string(log).unwrap(), "left\nright\nfront\nback\ndark\n");
}

#[test]
fn lamps_that_are_one_are_refused_in_any_spelling_and_a_flash_on_a_lamp_is_too() {
    let wled = |url: &str| format!("driver = \"wled\"\nurl = {url:?}\nstrip = {{ pixels = 9 }}\n");
    let plug =
        |more: &str| format!("driver = \"mqtt\"\nplug = {{ dialect = \"tasmota\", name = \"p\"{more} }}\n");
    let gpio = |chip: &str| format!("driver = \"gpio\"\nline = {{ {chip}name = \"GPIO17\" }}\n");
    let program = || "driver = \"command\"\non = [\"lamp\", \"on\"]\noff = [\"lamp\", \"off\"]\n".to_owned();
    let check = |left: &str, right: &str, flash: &str| {
        let text = format!("{CAMERA}[mqtt]\nhost = \"h\"\n[lamps.left]\n{left}[lamps.right]\n{right}{flash}");
        parse(&text).unwrap().check().map_err(|error| error.to_string())
    };
    for (left, right) in [
        (wled("http://localhost"), wled("http://127.0.0.1:80/")),
        (wled("http://WLED.local/"), wled("http://wled.local")),
        (plug(""), plug(", timeout_s = 9.0")),
        (gpio(""), gpio("chip = \"pinctrl-rp1\", ")),
        (program(), program()),
    ] {
        let problem = check(&left, &right, "").unwrap_err();
        assert!(problem.contains("left and right are on the same pixels"), "{problem}");
    }
    let two = (wled("http://one"), wled("http://two"));
    assert_eq!(check(&two.0, &two.1, ""), Ok(()));
    for lamp in [plug(""), gpio(""), program()] {
        let problem = check(&two.0, &lamp, &format!("[flash]\n{lamp}")).unwrap_err();
        assert!(problem.contains("flash: it is on the line, plug or programs of right"), "{problem}");
    }
}

#[test]
fn no_two_of_four_lamps_share_a_device() {
    let leds = |name: &str, first: u16| {
        format!("[lamps.{name}]\ndriver = \"leds\"\nstrip = {{ first = {first}, pixels = 9 }}\n")
    };
    let lamps = |back: u16| {
        let lamps = leds("left", 0) + &leds("right", 9) + &leds("front", 18) + &leds("back", back);
        parse(&format!("{CAMERA}{lamps}")).unwrap().check()
    };
    assert_eq!(lamps(27), Ok(()));
    let problem = lamps(10).unwrap_err().to_string();
    assert!(problem.contains("right and back are on the same pixels"), "{problem}");
}

#[test]
fn places_in_the_photograph_are_those_of_the_lamps() {
    let place = "{ x = 0, y = 0, width = 9, height = 9 }";
    let view = |names: &[&str]| {
        let places: String = names.iter().map(|name| format!("{name} = {place}\n")).collect();
        parse(&format!("[lamps_in_view]\n{places}{CAMERA}{LAMPS}")).unwrap()
    };
    let rig = view(&["right", "left"]);
    assert_eq!((rig.check(), view(&[]).check()), (Ok(()), Ok(())));
    assert_eq!(toml::from_str::<RigFile>(&toml::to_string(&rig).unwrap()).unwrap(), rig);
    assert!(view(&["left"]).check().unwrap_err().to_string().contains("the place of right is missing"));
    assert!(view(&["left", "front"]).check().unwrap_err().to_string().contains("the place of front"));
}

#[test]
fn a_camera_at_the_side_has_its_own_calibration() {
    let front = "[camera]\ndriver = \"folder\"\nfolder = \"front\"\n\
                 [lamps.left]\ndriver = \"command\"\non = [\"left\"]\noff = [\"left-off\"]\n\
                 [lamps.right]\ndriver = \"command\"\non = [\"right\"]\noff = [\"right-off\"]\n\
                 [calibration]\npx_per_cm = 8.0\nwidth = 640\nheight = 480\nbase = { x = 320.0, y = 440.0 }\n";
    let side = "[side.camera]\ndriver = \"folder\"\nfolder = \"side\"\n\
                [side.calibration]\npx_per_cm = 9.0\nwidth = 640\nheight = 480\nbase = { x = 300.0, y = 440.0 }\n";
    let rig: RigFile = toml::from_str(&format!("{front}{side}")).unwrap();
    let table = rig.side.as_ref().unwrap();
    assert_eq!(table.distance_cm, [74.0; 2]);
    assert!(rig.faults().is_empty(), "{:?}", rig.faults());
    let again: RigFile = toml::from_str(&toml::to_string(&rig).unwrap()).unwrap();
    assert_eq!(again, rig);
    let near = format!("{front}[side]\ndistance_cm = [74.0, 0.0]\n{side}");
    let faults = toml::from_str::<RigFile>(&near).unwrap().faults();
    assert!(faults.iter().any(|fault| fault.to_string().contains("side: found distance_cm = [74.0, 0.0]")));
    let beside_tent = toml::from_str::<RigFile>(&format!("[greenhouse]\n{side}")).unwrap().check();
    assert!(beside_tent.unwrap_err().to_string().contains("either [greenhouse] or real devices"));
}
