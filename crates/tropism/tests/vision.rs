//! Vision on drawn and on real photographs.
//!
//! Real ones are read from the folder named by `TROPISM_DATA`; where it is unset those tests say so and pass.

use std::path::{Path, PathBuf};

use tropism::geometry::{Pixel, Region};
use tropism::light;
use tropism::math;
use tropism::photo::{Image, Photo};
use tropism::vision::{Mode, VisionConfig, lit, look_from};

/// A folder of real photographs, or `None` with a line that says why the test is skipped.
fn real(folder: &str) -> Option<PathBuf> {
    let Some(data) = std::env::var_os("TROPISM_DATA") else {
        println!("skipped: TROPISM_DATA does not name the folder of real photographs");
        return None;
    };
    Some(Path::new(&data).join("real").join(folder))
}

fn open(path: &Path) -> Image {
    let bytes = std::fs::read(path).unwrap();
    Photo { name: path.display().to_string(), bytes, time_s: 0.0 }.decode().unwrap()
}

/// The rows of a table, each as a look-up by column.
fn rows(path: &Path) -> Vec<impl Fn(&str) -> String + use<>> {
    let mut table = csv::Reader::from_path(path).unwrap();
    let header = table.headers().unwrap().clone();
    table
        .records()
        .map(|record| {
            let (record, header) = (record.unwrap(), header.clone());
            move |column: &str| {
                let at = header.iter().position(|name| name == column);
                record[at.unwrap_or_else(|| panic!("no column {column}"))].to_owned()
            }
        })
        .collect()
}

/// How far a tip is from a marked one whose top is flat: anywhere along it is as good.
fn miss(tip: Pixel, row: &impl Fn(&str) -> String) -> f64 {
    let number = |column: &str| row(column).parse::<f64>().unwrap();
    let x = tip.x.clamp(number("top_flat_x_min_px"), number("top_flat_x_max_px"));
    math::hypot(tip.x - x, tip.y - number("top_y_px"))
}

/// Above the liner's rear edge, between the cloth's folds.
const BEAN: Region = Region { x: 290, y: 150, width: 150, height: 186 };
const BEAN_BASE: Pixel = Pixel::new(362.0, 336.0);

#[test]
fn the_real_bean_is_seen_on_every_photograph() {
    let Some(folder) = real("flora-robotica") else { return };
    for mode in [Mode::Paper, Mode::Robust] {
        let config = VisionConfig { mode, crop: Some(BEAN), ..VisionConfig::default() };
        let mut misses = Vec::new();
        for frame in 0..94 {
            let image = open(&folder.join(format!("{frame:04}.jpg")));
            assert!(look_from(&image, Some(BEAN_BASE), &config).is_some(), "{mode:?}, frame {frame}");
        }
        for row in rows(&folder.with_file_name("annotations").join("flora-robotica.csv")) {
            let image = open(&folder.join(row("file")));
            let tip = look_from(&image, Some(BEAN_BASE), &config).unwrap().tip;
            misses.push(miss(tip, &row));
        }
        let worst = misses.iter().copied().fold(0.0, f64::max);
        println!(
            "{mode:?}: mean {:.2} px, worst {worst:.2} px",
            misses.iter().sum::<f64>() / misses.len() as f64
        );
        assert!(worst <= 4.0, "{mode:?}: {misses:?}");
    }
}

#[test]
fn the_lit_lamp_is_read_from_every_photograph() {
    let Some(folder) = real("flora-robotica") else { return };
    let marked = rows(&folder.join("light.csv"));
    assert_eq!(marked.len(), 94);
    for row in marked {
        let image = open(&folder.join(row("frame") + ".jpg"));
        assert_eq!(light::name(lit(&image, None)), row("light"), "frame {}", row("frame"));
    }
}

/// Each seedling's region and base.
const SUNFLOWERS: [(Region, Pixel); 3] = [
    (Region { x: 130, y: 40, width: 250, height: 258 }, Pixel::new(273.0, 309.0)),
    (Region { x: 430, y: 20, width: 240, height: 275 }, Pixel::new(557.0, 306.0)),
    (Region { x: 730, y: 40, width: 250, height: 255 }, Pixel::new(799.0, 304.0)),
];

#[test]
fn three_sunflowers_are_seen_by_day_and_night() {
    let Some(folder) = real("sunflower-timelapse") else { return };
    for mode in [Mode::Paper, Mode::Robust] {
        for (plant, (crop, base)) in (1..).zip(SUNFLOWERS) {
            let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
            let mut misses = Vec::new();
            for row in rows(&folder.join("frames.csv")) {
                let image = open(&folder.join(row("file")));
                assert!(look_from(&image, Some(base), &config).is_some(), "{mode:?} {plant} {}", row("file"));
            }
            let marks = folder.with_file_name("annotations").join("sunflower-timelapse.csv");
            for row in rows(&marks).iter().filter(|row| row("plant") == plant.to_string()) {
                let image = open(&folder.join(row("file")));
                let tip = look_from(&image, Some(base), &config).unwrap().tip;
                misses.push(miss(tip, row));
            }
            let worst = misses.iter().copied().fold(0.0, f64::max);
            println!("{mode:?} plant {plant}: worst {worst:.2} px {misses:.1?}");
            assert!(worst <= 5.0, "{mode:?}, plant {plant}: {misses:?}");
        }
    }
}
