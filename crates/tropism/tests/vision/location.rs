//! Plants that are found by their motion, in real series.

use tropism::geometry::{Pixel, Region};
use tropism::photo::Image;
use tropism::vision::location::{Location, locate};
use tropism::vision::{Direction, VisionConfig};

use super::{photo, real};

/// Photographs that are read of a series, at equal distances: as many as are compared.
const READ: usize = 49;

fn series(folder: &str) -> Option<Vec<Image>> {
    let mut paths: Vec<_> =
        std::fs::read_dir(real(folder)?).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "jpg"));
    paths.sort();
    let read = |index: usize| photo(std::fs::read(&paths[index]).unwrap()).decode().unwrap();
    let count = READ.min(paths.len());
    Some((0..count).map(|index| read(index * (paths.len() - 1) / (count - 1))).collect())
}

fn cut(images: &[Image], Region { x, y, width, height }: Region) -> Vec<Image> {
    let cut = |image: &Image| {
        let row = |row: usize| &image.rgb[3 * (row * image.width + x)..][..3 * width];
        Image { width, height, rgb: (y..y + height).flat_map(row).copied().collect() }
    };
    images.iter().map(cut).collect()
}

fn found(images: &[Image]) -> Location {
    locate(images.len(), |index| images.get(index).cloned(), &VisionConfig::default(), &Direction::ALL)
}

/// A picture turned to the left by a quarter.
fn turned(image: &Image) -> Image {
    let (width, height) = (image.height, image.width);
    let at = |index: usize| image.at(image.width - 1 - index / width, index % width);
    Image { width, height, rgb: (0..width * height).flat_map(at).collect() }
}

/// Where a plant is in pictures of a size after a turn to the left, when it grows to `up`.
fn turned_location(location: &Location, width: usize, up: Direction) -> Location {
    let Location::Plant { region: Region { x, y, width: columns, height: rows }, base, .. } = *location
    else {
        panic!("{location:?}")
    };
    let region = Region { x: y, y: width - x - columns, width: rows, height: columns };
    Location::Plant { region, base: Pixel::new(base.y, width as f64 - 1.0 - base.x), up }
}

/// A shoot that leans more and more to the right above a root in soil.
fn leaning_shoot() -> Vec<Image> {
    let (width, height) = (120, 90);
    let picture = |step: usize| {
        let mut image = Image { width, height, rgb: vec![20; 3 * width * height] };
        let mut paint = |x: usize, y: usize| image.rgb[3 * (y * width + x)..][..3].fill(200);
        (0..width).for_each(|x| (80..height).for_each(|y| paint(x, y)));
        for y in 20..80 {
            let left = 40 + step * (80 - y) * (80 - y) / 2_500;
            (left..left + 5).for_each(|x| paint(x, y));
        }
        image
    };
    (0..12).map(picture).collect()
}

#[test]
fn a_plant_is_found_whichever_way_it_grows() {
    let mut images = leaning_shoot();
    let mut wanted = found(&images);
    let Location::Plant { base, up: Direction::Up, .. } = wanted else { panic!("{wanted:?}") };
    assert!((base.x - 42.0).abs() < 3.0 && (base.y - 79.0).abs() < 3.0, "{base:?}");
    for up in [Direction::Left, Direction::Down, Direction::Right] {
        wanted = turned_location(&wanted, images[0].width, up);
        images = images.iter().map(turned).collect();
        assert_eq!(found(&images), wanted);
    }
}

/// Roots of the bean and of the sunflowers, as marked by hand.
const BEAN: (f64, f64) = (363.0, 336.0);
const SUNFLOWERS: [(f64, f64); 3] = [(272.0, 310.0), (559.0, 308.0), (799.0, 304.0)];

/// The parts of the pictures around each sunflower, in each set: left edges, and the width. Later they sway further.
const CUTS: [([usize; 3], usize); 2] = [([130, 420, 710], 270), ([100, 395, 690], 300)];

/// Whether a plant is found with its root.
fn is_found(what: &str, location: &Location, (x, y): (f64, f64)) -> bool {
    println!("{what}: {location:?}");
    let Location::Plant { region, base, up: Direction::Up } = location else { return false };
    (base.x - x).abs() < 15.0
        && (base.y - y).abs() < 15.0
        && (region.x..region.x + region.width).contains(&(x as usize))
}

/// Each series is decoded once for both: the plants that are found, and the cuttings in which none is sure.
///
/// Settings were chosen on the first sets, but for the gap and the widening, which the bean of the second one asked for.
#[test]
fn single_real_plants_are_found_with_their_roots_and_other_pictures_are_not_sure() {
    let is_unsure = |what: &str, images: &[Image]| {
        let location = found(images);
        println!("{what}: {location:?}");
        assert!(!matches!(location, Location::Plant { .. }), "{what}: {location:?}");
    };
    for (half, (cuts, width)) in ["", "-2"].into_iter().zip(CUTS) {
        let mut count = 0;
        let folder = format!("flora-robotica{half}");
        let Some(bean) = series(&folder) else { return };
        count += u32::from(is_found(&folder, &found(&bean), BEAN));
        is_unsure("no root", &cut(&bean, Region { x: 0, y: 0, width: 720, height: 250 }));
        drop(bean);
        let folder = format!("sunflower-timelapse{half}");
        let sunflowers = series(&folder).unwrap();
        for (x, root) in cuts.into_iter().zip(SUNFLOWERS) {
            let images = cut(&sunflowers, Region { x, y: 0, width, height: 600 });
            let location = found(&images);
            count += u32::from(is_found(&folder, &location, (root.0 - x as f64, root.1)));
            // The narrowest cut has the fewest pixels to turn.
            if x == CUTS[0].0[0] {
                let left: Vec<Image> = images.iter().map(turned).collect();
                assert_eq!(found(&left), turned_location(&location, width, Direction::Left));
            }
        }
        assert_eq!(count, 4, "series{half}");
        is_unsure("three plants", &sunflowers);
        is_unsure("soil", &cut(&sunflowers, Region { x: 0, y: 340, width: 1000, height: 360 }));
        drop(sunflowers);
        is_unsure("other plants", &series(&format!("sunflower-centerlines{half}/images")).unwrap());
    }
}
