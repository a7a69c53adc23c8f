//! `tropism track` on folders as users have them.

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;
use tropism::observation::Quality;
use tropism::photo::Image;
use tropism::track::Track;

const WIDTH: usize = 120;
const HEIGHT: usize = 90;

/// A green stem a pixel or three wide from row 80 up to `top`, around column `x`.
fn stem(image: &mut Image, x: usize, top: usize) {
    for y in top..80 {
        image.rgb[3 * (y * image.width + x - 1)..][..9].copy_from_slice(&[60, 220, 80].repeat(3));
    }
}

fn dark() -> Image {
    let rgb = (0..3 * WIDTH * HEIGHT).map(|i| 18 + (i * 7919 % 5) as u8).collect();
    Image { width: WIDTH, height: HEIGHT, rgb }
}

/// A photograph of two plants, left lamp lit, as a JPEG.
fn photograph(step: usize) -> Vec<u8> {
    let mut image = dark();
    stem(&mut image, 35 + step % 4, 60 - step);
    stem(&mut image, 85, 50 - step);
    for y in 5..25 {
        image.rgb[3 * (y * WIDTH + 2)..][..3 * 12].fill(255);
    }
    image.to_jpeg(92).unwrap()
}

/// Twelve photographs, five minutes apart by their names, with a gap of a quarter of an hour after the eighth.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    for step in 0..12 {
        let minutes = 5 * if step < 8 { step } else { step + 2 };
        let name = format!("photos/cam_20240501_12{minutes:02}00.jpg");
        if minutes < 60 {
            fs::write(folder.path().join(name), photograph(step)).unwrap();
        } else {
            let name = format!("photos/cam_20240501_13{:02}00.jpg", minutes - 60);
            fs::write(folder.path().join(name), photograph(step)).unwrap();
        }
    }
    folder
}

fn tropism(folder: &Path, line: &str) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

#[track_caller]
fn succeeds(folder: &TempDir, line: &str) -> String {
    let (code, out, error) = tropism(folder.path(), line);
    assert_eq!(code, 0, "{line}: {error}");
    out
}

fn track(folder: &TempDir, name: &str) -> Track {
    Track::read_csv(fs::read(folder.path().join(name)).unwrap().as_slice()).unwrap()
}

fn json(folder: &TempDir, name: &str) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(folder.path().join(name)).unwrap()).unwrap()
}

const ONE: &str = "track photos --roi 60,5,55,75 --base 85,79 --scale 10,80,60,80=10 --out one.csv";

#[test]
fn times_units_and_provenance() {
    let folder = folder();
    let words = succeeds(&folder, ONE);
    assert!(words.contains("12 photographs, one every 5 min by their names, 2 missing"), "{words}");
    assert!(words.contains("12 measured, 0 carried forward"), "{words}");
    let track = track(&folder, "one.csv");
    let steps: Vec<u32> = track.samples.iter().map(|sample| sample.step).collect();
    assert_eq!(steps, [0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13]);
    assert_eq!(track.samples[8].time_s, 3_000.0);
    // 5 pixels a cm; the plant's top is the upper edge of row 50.
    assert!((track.samples[0].tip.y - (79.0 - 49.5) / 5.0).abs() < 0.2, "{:?}", track.samples[0]);
    let column = |name: &str| track.numbers(name).unwrap_or_else(|| panic!("no column {name}"));
    for (cm, px, axis) in [("tip_y_cm", "top_y_px", 79.0), ("stem_10_y_cm", "stem_10_y_px", 79.0)] {
        let in_cm: Vec<f64> = match cm {
            "tip_y_cm" => track.samples.iter().map(|sample| sample.tip.y).collect(),
            _ => column(cm),
        };
        for (cm, px) in in_cm.iter().zip(column(px)) {
            assert!((cm - (axis - px) / 5.0).abs() < 0.002, "{cm} cm, {px} px");
        }
    }
    assert!(column("length_cm").iter().all(|length| (4.0..9.0).contains(length)));
    assert!(column("apex_x_px").iter().all(|x| (x - 85.0).abs() < 2.0));
    let sidecar = json(&folder, "one.json");
    assert_eq!(sidecar["calibration"]["px_per_cm"], 5.0);
    assert_eq!(sidecar["frames"], 12);
    assert_eq!(sidecar["lights"]["left"], 12);
    assert_eq!(sidecar["settings_sha256"].as_str().unwrap().len(), 64);
    assert_eq!(sidecar["calibration_is_assumed"], false);
    succeeds(&folder, "fit one.csv --out model.json");
}

#[test]
fn a_track_taken_up_again_is_the_same() {
    let folder = folder();
    succeeds(&folder, ONE);
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let (track, sidecar, journal) = (read("one.csv"), read("one.json"), read("one.frames.jsonl"));
    // As a kill would leave it: no results yet, the journal cut in the middle of a line.
    for length in [journal.len() / 2, journal.len() - 1] {
        fs::remove_file(folder.path().join("one.csv")).unwrap();
        fs::remove_file(folder.path().join("one.json")).unwrap();
        fs::write(folder.path().join("one.frames.jsonl"), &journal[..length]).unwrap();
        succeeds(&folder, &format!("{ONE} --resume"));
        assert!(read("one.csv") == track && read("one.json") == sidecar);
        assert!(read("one.frames.jsonl") == journal);
    }
    // A photograph that has changed meanwhile is looked at again.
    fs::write(folder.path().join("photos/cam_20240501_120500.jpg"), photograph(9)).unwrap();
    succeeds(&folder, &format!("{ONE} --resume"));
    assert!(read("one.csv") != track);
    // Other settings are another track.
    let (code, _, error) = tropism(folder.path(), &format!("{ONE} --resume --mode paper"));
    let refusal = "one.frames.jsonl: found photographs that were judged with other settings: \
                   `vision.mode` = \"robust\", wanted \"paper\";";
    assert!(code == 1 && error.contains(refusal), "{error}");
}

#[test]
fn hindsight_fills_gaps_and_measures_nothing() {
    let folder = folder();
    let path = folder.path().join("photos/cam_20240501_122000.jpg");
    fs::write(path, dark().to_jpeg(90).unwrap()).unwrap();
    succeeds(&folder, ONE);
    let track = track(&folder, "one.csv");
    let column = |name: &str| track.numbers(name).unwrap_or_else(|| panic!("no column {name}"));
    let (smooth, unsure) = (column("smooth_y_cm"), column("smooth_sd_cm"));
    // The stem grows by a pixel a step: the tip carried forward stays behind, the smoothed one does not.
    let held = &track.samples[4];
    assert_eq!(held.quality, Quality::CarriedForward);
    let between = 0.5 * (track.samples[3].tip.y + track.samples[5].tip.y);
    assert!((held.tip.y - between).abs() > 0.15 && (smooth[4] - between).abs() < 0.06, "{smooth:?}");
    assert!(unsure[4] > unsure[3], "{unsure:?}");
    let measured = track.samples.iter().filter(|sample| sample.quality == Quality::Measured).count();
    assert_eq!((measured, json(&folder, "one.json")["measured"].as_u64()), (11, Some(11)));
    assert!(track.samples.iter().zip(&smooth).all(|(sample, y)| (sample.tip.y - y).abs() < 0.25));
}

#[test]
fn a_region_that_is_too_small_is_named() {
    let folder = folder();
    let words = succeeds(&folder, &ONE.replace("60,5,55,75", "60,42,55,38"));
    assert!(words.contains("the plant reaches the edge of its region (top)"), "{words}");
    let edges = &json(&folder, "one.json")["leaves_view_at"];
    assert!(edges["top"].as_u64() > Some(0) && edges["left"].is_null(), "{edges}");
}

/// Twenty-four photographs of one stem, the picture of a white wall behind it from column `wall` on.
fn before_a_wall(wall: usize) -> TempDir {
    series(wall, |_, _| {})
}

/// The same with more that is drawn in each photograph.
fn series(wall: usize, more: impl Fn(&mut Image, usize)) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    for step in 0..24 {
        let mut image = dark();
        for row in 0..HEIGHT {
            image.rgb[3 * (row * WIDTH + wall)..3 * (row + 1) * WIDTH].fill(170);
        }
        stem(&mut image, 35 + step % 4, 60 - step);
        more(&mut image, step);
        let name = format!("photos/cam_20240501_{:02}{:02}00.jpg", 12 + step / 12, 5 * (step % 12));
        fs::write(folder.path().join(name), image.to_jpeg(92).unwrap()).unwrap();
    }
    folder
}

#[test]
fn wrong_regions_give_a_warning_and_no_model_is_fitted_to_them_unasked() {
    let kinds = |folder: &TempDir| -> Vec<String> {
        let warnings = json(folder, "t.json")["warnings"].as_array().unwrap().clone();
        warnings.iter().map(|warning| warning["kind"].as_str().unwrap().to_owned()).collect()
    };
    let warned = |folder: &TempDir, line: &str, wanted: &[&str], advice: &str| {
        let words = succeeds(folder, &format!("track photos {line} --light left.csv --out t.csv --force"));
        assert_eq!(kinds(folder), wanted, "{line}: {words}");
        assert!(words.contains(advice), "{line}: {words}");
        assert!(words.contains("next: tropism track photos --guide"), "{line}: {words}");
        let (code, _, error) = tropism(folder.path(), "fit t.csv --out model.json");
        assert!(code == 1 && error.contains("t.csv: ") && error.contains("--anyway"), "{line}: {error}");
        assert!(!folder.path().join("model.json").exists());
    };
    let folder = before_a_wall(60);
    // Another plant, whose leaf touches the stem.
    let neighbour = series(90, |image, step| {
        stem(image, 52 + step % 4, 62);
        for row in 66..69 {
            image.rgb[3 * (row * WIDTH + 35)..3 * (row * WIDTH + 53)].fill(150);
        }
    });
    let names = fs::read_dir(folder.path().join("photos")).unwrap();
    let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let table: String = names.map(|name| format!("{name},left\n")).collect();
    for folder in [&folder, &neighbour] {
        fs::write(folder.path().join("left.csv"), format!("frame,light\n{table}")).unwrap();
    }
    let here = "--base 36,79 --scale 5";
    warned(&folder, &format!("--roi 5,51,60,30 {here}"), &["few_measured", "tip_at_edge"], "less than half");
    warned(&folder, "--roi 5,5,60,75 --base 45,79 --scale 5", &["root_elsewhere"], "stem begins at 3");
    warned(&folder, "--roi 5,5,60,75 --base 36,79", &["scale_assumed"], "give --scale");
    warned(&neighbour, &format!("--roi 5,5,75,75 {here}"), &["plants_touch"], "end the --roi between them");
    // `--anyway` makes `fit` take the track. A good track needs no option.
    succeeds(&folder, "fit t.csv --anyway --out model.json");
    let words =
        succeeds(&folder, &format!("track photos --roi 5,5,60,75 {here} --light left.csv --out good.csv"));
    assert!(words.contains("next: tropism fit"), "{words}");
    succeeds(&folder, "fit good.csv --out good-model.json");
    // Rows of any source that are held for the most part are uncertain too.
    let mut text = fs::read_to_string(folder.path().join("good.csv")).unwrap();
    text = text.replacen("measured", "carried_forward", 13);
    fs::write(folder.path().join("held.csv"), text).unwrap();
    let (code, _, error) = tropism(folder.path(), "fit held.csv --out held-model.json");
    assert!(code == 1 && error.contains("carried forward in 13 of 24 rows"), "{error}");
}

#[test]
fn a_white_wall_is_not_dark() {
    let folder = before_a_wall(30);
    let (code, _, error) = tropism(folder.path(), "track photos --roi 70,5,40,75 --scale 5 --out t.csv");
    assert!(
        code == 1
            && error.contains("no_plant 24")
            && error.contains("--guide writes a page")
            && !error.contains("dark"),
        "{error}"
    );
    let words =
        succeeds(&before_a_wall(60), "track photos --roi 5,5,60,75 --base 36,79 --scale 5 --out t.csv");
    assert!(!words.contains("dark"), "{words}");
}

#[test]
fn results_are_never_replaced_unasked() {
    let folder = folder();
    succeeds(&folder, ONE);
    let before = fs::read(folder.path().join("one.csv")).unwrap();
    let (code, _, error) = tropism(folder.path(), &format!("{ONE} --mode paper"));
    assert_eq!(code, 1);
    assert!(
        error.contains("results are here already: choose a new name, go on with them by --resume"),
        "{error}"
    );
    assert!(fs::read(folder.path().join("one.csv")).unwrap() == before);
    succeeds(&folder, &format!("{ONE} --mode paper --force"));
    assert!(fs::read(folder.path().join("one.csv")).unwrap() != before);
}

#[test]
fn several_plants_have_a_track_each() {
    let folder = folder();
    let words = succeeds(
        &folder,
        "track photos --roi 15,5,45,75 --roi 60,5,55,75 --base 36,79 --base 85,79 --scale 5 --out both.csv \
         --overlay look --sheet sheet.jpg",
    );
    assert!(words.contains("plant 1: 12 measured") && words.contains("plant 2: 12 measured"), "{words}");
    let tops = ["both-1.csv", "both-2.csv"].map(|name| track(&folder, name).numbers("top_x_px").unwrap());
    assert!(
        tops[0].iter().all(|x| (30.0..45.0).contains(x)) && tops[1].iter().all(|x| (80.0..90.0).contains(x))
    );
    assert_eq!(fs::read_dir(folder.path().join("look")).unwrap().count(), 12);
    assert!(folder.path().join("sheet.jpg").exists());
    let plants = "[[plant]]\nname = \"right\"\nregion = { x = 60, y = 5, width = 55, height = 75 }\n\
                  base = { x = 85, y = 79 }\n[[plant]]\nname = \"left\"\n\
                  region = { x = 15, y = 5, width = 45, height = 75 }\nbase = { x = 36, y = 79 }\n";
    fs::write(folder.path().join("plants.toml"), plants).unwrap();
    succeeds(&folder, "track photos --plant-file plants.toml --scale 5 --out named.csv");
    assert_eq!(track(&folder, "named-left.csv"), track(&folder, "both-1.csv"));
    assert_eq!(json(&folder, "named-right.json")["plant"], "right");
}

#[test]
fn a_clicked_tip_is_followed_and_a_click_elsewhere_is_refused() {
    let folder = folder();
    let line = "track photos --base 85,79 --scale 5 --light none --out c.csv";
    let words = succeeds(
        &folder,
        &format!("{line} --tip 1,85,50 --tip cam_20240501_130500.jpg,85,39 --node 1,85,55"),
    );
    assert!(words.contains("12 measured, 0 carried forward"), "{words}");
    let tops = track(&folder, "c.csv").numbers("top_y_px").unwrap();
    assert!(tops.iter().zip(0..).all(|(top, step)| (top - f64::from(50 - step)).abs() < 2.0), "{tops:?}");
    let found = json(&folder, "c.json");
    assert_eq!(found["clicks"]["tip"].as_array().unwrap().len(), 2);
    assert!(found["next_click"].is_null());
    for (clicks, wanted) in [
        ("--tip 13,85,50", "\"13\", which is not in the series"),
        ("--tip a.jpg,85,50", "which is not in the series"),
        ("--tip 1,85,500", "outside of the photograph"),
        ("--tip 1,85,50 --tip 1,85,52", "found two clicks on the same point, at 85,50 and 85,52"),
        ("--tip 85,50", "wanted a photograph's name or number and a pixel"),
        ("--roi 5,5,60,75 --roi 70,5,50,75 --base 85,79 --tip 1,67,50", "none or several of the plants"),
    ] {
        let (code, _, error) = tropism(folder.path(), &format!("{line} {clicks} --force"));
        assert!(code != 0 && error.contains(wanted), "{clicks}: {error}");
    }
}

#[test]
fn a_clicked_stem_that_no_rule_finds_has_a_line_to_the_same_bits_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    // A stem from the right, before a wall of squares. A card hides its middle in some photographs.
    let middle = |x: usize, step: usize| 70.0 - 0.003 * step as f64 * ((150 - x) as f64).powi(2) / 8.0;
    for step in 0..9 {
        let rgb = (0..180 * 120).flat_map(|index| {
            let (x, y) = (index % 180, index / 180);
            let noise = (index * 7919 % 9) as u8;
            let is_stem = (40..150).contains(&x) && (y as f64 - middle(x, step)).abs() < 3.0;
            let is_hidden = step == 5 && (70..120).contains(&x);
            match () {
                () if is_hidden => [130, 130, 130],
                () if is_stem => [90 + noise, 150 + noise, 60 + noise],
                () => [[40, 40, 60], [80, 70, 70], [60, 80, 100]][(x / 23 + y / 19) % 3]
                    .map(|level: u8| level + noise),
            }
        });
        let image = Image { width: 180, height: 120, rgb: rgb.collect() };
        fs::write(folder.path().join(format!("photos/{step}.jpg")), image.to_jpeg(95).unwrap()).unwrap();
    }
    let tip = |step: usize| format!("--tip {},40,{:.1}", step + 1, middle(40, step));
    let line = format!(
        "track photos --base 150,70 --scale 10 --light none --time even {} {} {}",
        tip(0),
        tip(4),
        tip(8)
    );
    for threads in [1, 2] {
        succeeds(&folder, &format!("{line} --threads {threads} --out on{threads}.csv"));
    }
    let found = track(&folder, "on1.csv");
    assert_eq!(found, track(&folder, "on2.csv"));
    let column = |name: &str| found.numbers(name).unwrap();
    let (x, y) = (column("stem_6_x_px"), column("stem_6_y_px"));
    assert!(x[5].is_nan() && column("length_cm")[5].is_nan(), "the stem is hidden");
    let answered: Vec<usize> = (0..9).filter(|&step| !x[step].is_nan()).collect();
    assert!(answered.len() >= 5, "{answered:?}");
    for step in answered {
        assert!((y[step] - middle(x[step] as usize, step)).abs() < 2.0, "{step}: {}, {}", x[step], y[step]);
    }
}

#[test]
fn what_never_moves_is_no_plant() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    for step in 0..24 {
        let mut image = dark();
        stem(&mut image, 60, 30);
        // Something else changes, so that photographs are no repetitions.
        image.rgb[3 * step..][..3].fill(250);
        fs::write(folder.path().join(format!("photos/{step}.jpg")), image.to_jpeg(92).unwrap()).unwrap();
    }
    let (code, _, error) = tropism(folder.path(), "track photos --light none --out t.csv");
    assert!(code != 0 && error.contains("never moves") && error.contains("--guide"), "{error}");
    assert!(!folder.path().join("t.csv").exists());
    succeeds(&folder, "track photos --light none --roi 40,5,40,75 --base 60,79 --scale 5 --out t.csv");
    assert_eq!(json(&folder, "t.json")["warnings"][0]["kind"], "never_moves");
}

#[test]
fn bad_files_are_classes_and_never_end_a_batch() {
    let folder = folder();
    let whole = photograph(3);
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join("photos").join(name), bytes).unwrap();
    // Every kind of bad file, between the photographs of 12:05 and 12:10.
    let mut huge = whole.clone();
    let sof = huge.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    huge[sof + 5..sof + 9].copy_from_slice(&[0x27, 0x10, 0x27, 0x10]);
    let pixel = Image { width: 1, height: 1, rgb: vec![9; 3] }.to_jpeg(90).unwrap();
    put("cam_20240501_120505.jpg", b"");
    put("cam_20240501_120502.jpg", b"this is no photograph");
    put("cam_20240501_120503.jpg", &huge);
    put("cam_20240501_120504.jpg", &pixel);
    put("cam_20240501_120501.jpg", &fs::read(folder.path().join("photos/cam_20240501_120500.jpg")).unwrap());
    put("cam_20240501_120507.jpg", &dark().to_jpeg(90).unwrap());
    for tenth in 1..10 {
        put(&format!("cam_20240501_12060{tenth}.jpg"), &whole[..whole.len() * tenth / 10]);
    }
    let command = ONE.replace("--scale", "--period 5m --light auto --scale");
    let words = succeeds(&folder, &command);
    assert!(words.contains("12 measured, 15 carried forward"), "{words}");
    let sidecar = json(&folder, "one.json");
    let problem = |second: &str| {
        let name = format!("cam_20240501_120{second}.jpg");
        sidecar["problems"][&name].as_str().unwrap_or_else(|| panic!("{name}: {sidecar}")).to_owned()
    };
    for (second, wanted) in [
        ("505", "the file is empty"),
        ("502", "wanted a JPEG, PNG or TIFF"),
        ("503", "found 10000 x 10000 pixels, wanted at most"),
        ("504", "found a picture of 1 x 1, wanted 120 x 90 as calibrated"),
        ("501", "the same bytes as the photograph before"),
        ("601", "the picture is damaged"),
        ("609", "the data end before the last block"),
    ] {
        assert!(problem(second).contains(wanted), "{second}: {}", problem(second));
    }
    let track = track(&folder, "one.csv");
    let frames = track.columns.iter().find(|column| column.name == "frame").unwrap();
    let tops = track.numbers("top_y_px").unwrap();
    for (row, top) in tops.into_iter().enumerate() {
        let frame = frames.values.text(row);
        let is_bad = !frame.ends_with("00.jpg");
        assert_eq!(is_bad, top.is_nan(), "a tip carried forward has no place in the photograph: {frame}");
    }
}

#[test]
fn pictures_of_other_kinds_are_read_or_refused() {
    use jpeg_encoder::{ColorType, Encoder};
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join("photos").join(name), bytes).unwrap();
    let mut image = dark();
    stem(&mut image, 60, 40);
    put("1-plain.jpg", &image.to_jpeg(92).unwrap());
    let (width, height) = (WIDTH as u16, HEIGHT as u16);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 92);
    encoder.set_progressive(true);
    encoder.encode(&image.rgb, width, height, ColorType::Rgb).unwrap();
    put("2-progressive.jpg", &bytes);
    let mut bytes = Vec::new();
    let cmyk: Vec<u8> =
        image.rgb.chunks(3).flat_map(|rgb| [255 - rgb[0], 255 - rgb[1], 255 - rgb[2], 0]).collect();
    Encoder::new(&mut bytes, 92).encode(&cmyk, width, height, ColorType::Cmyk).unwrap();
    put("3-cmyk.jpg", &bytes);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width.into(), height.into());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    let deep: Vec<u8> = image.rgb.iter().flat_map(|&value| [value, 77]).collect();
    encoder.write_header().unwrap().write_image_data(&deep).unwrap();
    put("4-sixteen-bits.png", &bytes);
    succeeds(&folder, "track photos --roi 10,5,100,75 --base 60,79 --scale 5 --out t.csv");
    let track = track(&folder, "t.csv");
    assert_eq!(track.samples.len(), 4);
    for sample in &track.samples {
        assert!((sample.tip.y - (79.0 - 39.5) / 5.0).abs() < 0.3, "{sample:?}");
    }
}

#[test]
fn pages_light_tables_and_folders_of_names_are_read() {
    use ::tiff::encoder::{TiffEncoder, colortype};
    let folder = tempfile::tempdir().unwrap();
    let mut file = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    for step in 0..6 {
        let mut image = dark();
        stem(&mut image, 60, 50 - step);
        encoder.write_image::<colortype::RGB8>(WIDTH as u32, HEIGHT as u32, &image.rgb).unwrap();
    }
    fs::write(folder.path().join("stack.tif"), file.into_inner()).unwrap();
    let rows: String = (0..6).map(|page| format!("stack.tif#{page:04},left\n")).collect();
    fs::write(folder.path().join("light.csv"), format!("\u{feff}frame,light\n{rows}")).unwrap();
    let command =
        "track stack.tif --roi 10,5,100,75 --base 60,79 --scale 5 --light light.csv --out new/folder/t.csv";
    let words = succeeds(&folder, command);
    assert!(words.contains("6 measured"), "{words}");
    let found = track(&folder, "new/folder/t.csv");
    assert_eq!(found.samples.len(), 6);
    assert!((found.samples[5].tip.y - found.samples[0].tip.y - 1.0).abs() < 0.1, "{:?}", found.samples);
    // The pages have no times.
    let (code, _, error) = tropism(folder.path(), "fit new/folder/t.csv --out model.json");
    assert!(code == 1 && error.contains("5 min apart: give --period"), "{error}");
    succeeds(&folder, &format!("{command} --period 10m --force"));
    succeeds(&folder, "fit new/folder/t.csv --out model.json");
    fs::write(folder.path().join("light.csv"), format!("frame,light\n{rows}stack.tif#0003,right\n")).unwrap();
    let (code, _, error) = tropism(folder.path(), &format!("{command} --force"));
    assert!(code == 1 && error.contains("line 8: the frame of line 5 again"), "{error}");
}

#[test]
fn a_guide_is_a_page_that_needs_nothing_beside_it() {
    let folder = folder();
    fs::write(folder.path().join("photos/cam_20240501_120230.jpg"), "broken").unwrap();
    let words = succeeds(&folder, "track photos --guide guide.html");
    assert!(words.contains("wrote guide.html: open it in a browser"), "{words}");
    let page = || fs::read_to_string(folder.path().join("guide.html")).unwrap();
    let first = page();
    assert_eq!(first.matches("\"data\":\"/9j/").count(), 3, "three photographs");
    assert!(!first.contains("http://") && !first.contains("https://") && !first.contains("/*CONTENT*/"));
    // With a region, what is found there is drawn in; and the page may be made again.
    succeeds(&folder, "track photos --roi 60,5,55,75 --base 85,79 --guide guide.html");
    assert_ne!(page(), first);
    fs::write(folder.path().join("mine.html"), "<p>mine").unwrap();
    let (code, _, error) = tropism(folder.path(), "track photos --guide mine.html");
    assert!(code == 1 && error.contains("mine.html: another file is here already"), "{error}");
}

#[test]
fn a_report_of_a_track_shows_its_stems() {
    let folder = folder();
    succeeds(&folder, ONE);
    let words = succeeds(&folder, "report one.csv --out report.html");
    assert!(words.contains("figures 3, 4a, 4b, 5a, 5b, 5c, 5d, time, 9\nno figure 1: "), "{words}");
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("12 stems of one experiment") && page.contains("The plants are real."));
}

/// A checkerboard of 10 x 7 squares of 8 pixels on a white sheet.
fn board() -> Image {
    let mut image = Image { width: WIDTH, height: HEIGHT, rgb: vec![230; 3 * WIDTH * HEIGHT] };
    for (x, y) in (0..80).flat_map(|x| (0..56).map(move |y| (x, y))) {
        if (x / 8 + y / 8) % 2 == 0 {
            image.rgb[3 * ((y + 17) * WIDTH + x + 20)..][..3].fill(20);
        }
    }
    image
}

#[test]
fn calibrations_come_from_marks_geometry_and_a_checkerboard() {
    let folder = folder();
    fs::write(folder.path().join("board.jpg"), board().to_jpeg(95).unwrap()).unwrap();
    fs::write(folder.path().join("plant.jpg"), photograph(0)).unwrap();
    for (line, wanted) in [
        (
            "calibrate-camera plant.jpg --mark 10,80,60,80=10 --mark 10,80,10,30=10 --base 85,79 --out marks.toml",
            5.0,
        ),
        (
            "calibrate-camera plant.jpg --distance 12 --view 53.13010235 --base 85,79 --out geometry.toml",
            10.0,
        ),
        ("calibrate-camera board.jpg --checkerboard 9x6@1.6 --base 85,79 --out board.toml", 5.0),
    ] {
        let words = succeeds(&folder, line);
        let file = line.split_whitespace().last().unwrap();
        let calibration = toml::from_str::<tropism::vision::Calibration>(
            &fs::read_to_string(folder.path().join(file)).unwrap(),
        );
        let calibration = calibration.unwrap();
        assert!((calibration.px_per_cm - wanted).abs() < 0.02 * wanted, "{line}: {calibration:?}, {words}");
        assert_eq!(calibration.residual_mm.is_some(), file != "geometry.toml");
        assert_eq!(calibration.lens.is_some(), file == "board.toml");
    }
    // What is measured through the lens is what is measured without one.
    for file in ["marks", "board"] {
        let line = format!("track photos --calibration {file}.toml --roi 60,5,55,75 --out {file}.csv");
        succeeds(&folder, &line);
    }
    let [flat, bent] = ["marks.csv", "board.csv"].map(|file| track(&folder, file));
    for (flat, bent) in flat.samples.iter().zip(&bent.samples) {
        assert!(flat.tip.distance(bent.tip) < 0.15, "{flat:?}, {bent:?}");
    }
    for (line, wanted) in [
        ("calibrate-camera plant.jpg --checkerboard 9x6@1.6 --out t.toml", "plant.jpg: found"),
        (
            "calibrate-camera board.jpg --checkerboard 8x6@1.6 --out t.toml",
            "found 54 inner corners of a checkerboard, wanted 8 x 6",
        ),
        ("calibrate-camera board.jpg --checkerboard 9x6 --out t.toml", "such as 9x6@1.5"),
        ("calibrate-camera board.jpg --checkerboard 2x6@1 --out t.toml", "such as 9x6@1.5"),
        ("calibrate-camera board.jpg --mark 1,2,3,4 --out t.toml", "such as 30,420,195,421=15"),
        ("calibrate-camera board.jpg --mark 1,2,9000,4=15 --out t.toml", "no mark ends at 9000,4"),
        ("calibrate-camera board.jpg --distance 74 --out t.toml", "--view"),
        ("calibrate-camera board.jpg --distance 74 --view 180 --out t.toml", "found --view 180"),
        ("calibrate-camera board.jpg --out t.toml", "<--mark <X,Y,X,Y=CM>|--checkerboard"),
        ("calibrate-camera absent.jpg --mark 1,2,3,4=5 --out t.toml", "absent.jpg: cannot read"),
        ("calibrate-camera board.toml --mark 1,2,3,4=5 --out t.toml", "wanted a JPEG, PNG or TIFF"),
        (
            "calibrate-camera board.jpg --mark 1,2,3,4=5 --out board.toml",
            "board.toml: a file is here already",
        ),
    ] {
        let (code, _, error) = tropism(folder.path(), line);
        assert!(code == 1 || code == 2, "{line}: {code}");
        assert!(error.contains(wanted) && !error.contains("panicked"), "{line}: {error}");
    }
    assert!(!folder.path().join("t.toml").exists());
}

#[test]
fn two_cameras_see_in_space() {
    let folder = folder();
    // A second camera at the right sees the same plant further left, so nearer to the first camera, by 1 cm.
    fs::create_dir(folder.path().join("beside")).unwrap();
    for (step, path) in
        tropism_lab::files::photographs(&[folder.path().join("photos")]).unwrap().iter().enumerate()
    {
        let mut image = dark();
        stem(&mut image, 55, 50 - step);
        fs::write(folder.path().join("beside").join(path.file_name().unwrap()), image.to_jpeg(92).unwrap())
            .unwrap();
    }
    succeeds(&folder, ONE);
    succeeds(&folder, "track beside --roi 30,5,55,75 --base 60,79 --scale 5 --out side.csv");
    let words = succeeds(&folder, "depth one.csv side.csv --distance 74,74 --out space.csv");
    assert!(words.contains("12 steps in space, 12 with the whole stem"), "{words}");
    let space = track(&folder, "space.csv");
    let column = |name: &str| space.numbers(name).unwrap_or_else(|| panic!("no column {name}"));
    for (name, wanted) in [("tip_z_cm", 1.0), ("apex_x_cm", 0.0), ("stem_5_z_cm", 1.0), ("stem_10_x_cm", 0.0)]
    {
        assert!(column(name).iter().all(|value| (value - wanted).abs() < 0.3), "{name}: {:?}", column(name));
    }
    assert!(column("tip_gap_cm").iter().all(|gap| *gap < 0.2));
    let error = |line: &str, wanted: &str| {
        let (code, _, error) = tropism(folder.path(), line);
        assert!(code == 1 || code == 2, "{line}: {code}");
        assert!(error.contains(wanted) && !error.contains("panicked"), "{line}: {error}");
    };
    error("depth one.csv side.csv --distance 74,74 --out space.csv", "space.csv: a file is here already");
    error("depth one.csv side.csv --distance 74,0 --out t.csv", "found --distance 74,0");
    error("depth one.csv absent.csv --distance 74,74 --out t.csv", "absent.csv: cannot read");
    fs::remove_file(folder.path().join("side.json")).unwrap();
    error("depth one.csv side.csv --distance 74,74 --out t.csv", "side.json: cannot read");
}

/// A JPEG with an Exif header: taken at a minute past noon, with the camera held as `turn` says.
fn with_exif(jpeg: &[u8], minute: usize, turn: u8) -> Vec<u8> {
    let mut exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x02".to_vec();
    exif.extend([1, 0x12, 0, 3, 0, 0, 0, 1, 0, turn, 0, 0]);
    exif.extend([1, 0x32, 0, 2, 0, 0, 0, 20, 0, 0, 0, 38, 0, 0, 0, 0]);
    exif.extend(format!("2024:05:01 12:{minute:02}:00\0").bytes());
    let length = (exif.len() + 2) as u16;
    [&jpeg[..2], &[0xff, 0xe1], &length.to_be_bytes(), &exif, &jpeg[2..]].concat()
}

#[test]
fn exif_headers_order_photographs_and_turn_them() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    // Named backwards, and taken by a camera that lay on its right side: its columns are the world's rows.
    for step in 0..4 {
        let mut upright = dark();
        stem(&mut upright, 85, 50 - step);
        let mut rgb = Vec::new();
        for (x, y) in (0..WIDTH).rev().flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
            rgb.extend(upright.at(x, y));
        }
        let lying = Image { width: HEIGHT, height: WIDTH, rgb }.to_jpeg(92).unwrap();
        let name = format!("photos/{}.jpg", 9 - step);
        fs::write(folder.path().join(name), with_exif(&lying, 10 * step, 6)).unwrap();
    }
    let words = succeeds(&folder, ONE);
    assert!(
        words.contains("4 photographs, one every 10 min by their Exif headers; 4 stand elsewhere"),
        "{words}"
    );
    let track = track(&folder, "one.csv");
    let frames = [0, 1, 2, 3].map(|row| track.columns[0].values.text(row));
    assert_eq!(frames, ["9.jpg", "8.jpg", "7.jpg", "6.jpg"]);
    let tops = track.numbers("top_y_px").unwrap();
    assert!(tops.windows(2).all(|pair| pair[1] < pair[0]) && (tops[0] - 49.5).abs() < 1.5, "{tops:?}");
}

#[test]
fn no_lamps_in_view_are_no_lamps() {
    let folder = folder();
    succeeds(&folder, &format!("{ONE} --light none"));
    assert!(track(&folder, "one.csv").samples.iter().all(|sample| sample.light.is_none()));
}

#[test]
fn wrong_use_is_one_clear_line() {
    let folder = folder();
    fs::create_dir(folder.path().join("empty")).unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put("small.toml", "px_per_cm = 5\nwidth = 60\nheight = 40\nbase = { x = 30, y = 39 }\n");
    put("twice.toml", "[[plant]]\nname = \"a\"\n[[plant]]\nname = \"a\"\n");
    put("slash.toml", "[[plant]]\nname = \"../a\"\n");
    put("none.toml", "plant = []\n");
    for (line, wanted) in [
        ("track empty --out t.csv", "empty: no photographs here: no .jpg, .jpeg, .png, .tif or .tiff file"),
        ("track photos --roi 100,50,50,50 --out t.csv", "--roi: found region"),
        (
            "track photos --roi 0,0,50,50 --roi 50,0,50,50 --base 5,5 --out t.csv",
            "found 1 x --base for 2 plants",
        ),
        (
            "track photos --calibration small.toml --out t.csv",
            "found no plant in any of 12 photographs (foreign 12)",
        ),
        ("track photos --plant-file twice.toml --out t.csv", "two plants have the name \"a\""),
        ("track photos --plant-file slash.toml --out t.csv", "found name \"../a\""),
        ("track photos --plant-file none.toml --out t.csv", "there is no [[plant]]"),
        ("track photos --time exif --out t.csv", "found times in the Exif headers of 0 of 12"),
        ("track photos --scale 1,2,3=4 --out t.csv", "wanted pixels per cm"),
        ("track photos --scale 1,2,1,2=4 --out t.csv", "wanted pixels per cm"),
        ("track photos --scale 1,2,3,4=0 --out t.csv", "wanted pixels per cm"),
        ("track photos --base 1,1 --roi 0,0,20,20 --out t.csv", "found no plant in any"),
        (
            "track photos --base 1e9,1 --out t.csv",
            "--base: found 1000000000,1, wanted a pixel in a picture of",
        ),
    ] {
        let (code, _, error) = tropism(folder.path(), line);
        assert!(code == 1 || code == 2, "{line}: {code}");
        assert!(error.contains(wanted) && !error.contains("panicked"), "{line}: {error}");
    }
    assert!(!folder.path().join("t.csv").exists() && !folder.path().join("t.frames.jsonl").exists());
}
