//! Figure 2: all photographs of an experiment in one composite picture.

use super::{Body, Figure, Plants};
use tropism::geometry::Region;
use tropism::photo::Image;

/// Largest width of a composite in a figure, in pixels.
const MAX_WIDTH: usize = 400;
/// Largest height of a composite in a figure, in pixels.
const MAX_HEIGHT: usize = 480;

/// Chosen by hand.
const JPEG_QUALITY: u8 = 82;

/// Maximum projection of photographs: the largest value of each pixel and channel.
///
/// In front of dark cloth it shows the plant in all its postures. Photographs are added one by one, so it needs the memory
/// of one.
#[derive(Clone, Debug, Default)]
pub struct Composite {
    maximum: Option<Image>,
}

impl Composite {
    /// Adds a photograph, unless its size differs from that of the first.
    pub fn add(&mut self, photograph: &Image) {
        match &mut self.maximum {
            None => self.maximum = Some(photograph.clone()),
            Some(image) if (image.width, image.height) == (photograph.width, photograph.height) => {
                for (value, other) in image.rgb.iter_mut().zip(&photograph.rgb) {
                    *value = (*value).max(*other);
                }
            }
            Some(_) => {}
        }
    }

    /// Only what lies in `region`; unchanged if the region is not inside the picture.
    #[must_use]
    pub fn cropped(self, region: Region) -> Self {
        let maximum = self.maximum.map(|image| super::cropped(&image, region).unwrap_or(image));
        Self { maximum }
    }

    /// The composite of the photographs so far; `None` before the first.
    #[must_use]
    pub const fn image(&self) -> Option<&Image> {
        self.maximum.as_ref()
    }
}

impl FromIterator<Image> for Composite {
    fn from_iter<T: IntoIterator<Item = Image>>(photographs: T) -> Self {
        photographs.into_iter().fold(Self::default(), |mut composite, photograph| {
            composite.add(&photograph);
            composite
        })
    }
}

/// Figure 2: the composites of all experiments side by side, at most 400 x 480 pixels each.
#[must_use]
pub fn composite(experiments: &[Composite], plants: Plants) -> Figure {
    let jpegs = experiments
        .iter()
        .filter_map(Composite::image)
        .filter_map(|image| reduced(image).to_jpeg(JPEG_QUALITY).ok());
    Figure {
        number: "2",
        title: "All photographs of each experiment".to_owned(),
        caption: format!(
            "The maximum of each pixel over the photographs of an experiment; the experiments in order from left to \
             right. {}",
            plants.sentence()
        ),
        data: String::new(),
        body: Body::Jpegs(jpegs.collect()),
    }
}

/// The picture reduced by a whole factor to fit the figure: means of square blocks, without incomplete blocks.
fn reduced(image: &Image) -> Image {
    let factor = image.width.div_ceil(MAX_WIDTH).max(image.height.div_ceil(MAX_HEIGHT)).max(1);
    let (width, height) = ((image.width / factor).max(1), (image.height / factor).max(1));
    let mut rgb = Vec::with_capacity(3 * width * height);
    for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
        let mut sums = [0_usize; 3];
        let (rows, columns) = (factor.min(image.height), factor.min(image.width));
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            for (sum, value) in sums.iter_mut().zip(image.at(column * factor + x, row * factor + y)) {
                *sum += usize::from(value);
            }
        }
        rgb.extend(sums.map(|sum| (sum / (rows * columns)) as u8));
    }
    Image { width, height, rgb }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::photo::Photo;

    fn plain(width: usize, height: usize, colour: [u8; 3]) -> Image {
        Image { width, height, rgb: colour.repeat(width * height) }
    }

    #[test]
    fn the_largest_value_of_each_channel_stays() {
        let photographs = [plain(4, 2, [10, 200, 0]), plain(4, 2, [90, 20, 0]), plain(2, 2, [255; 3])];
        let composite: Composite = photographs.into_iter().collect();
        assert_eq!(composite.image(), Some(&plain(4, 2, [90, 200, 0])));
    }

    #[test]
    fn a_composite_is_cropped_to_the_plant() {
        let composite: Composite = [plain(40, 20, [9; 3])].into_iter().collect();
        let region = Region { x: 10, y: 5, width: 12, height: 15 };
        assert_eq!(composite.clone().cropped(region).image(), Some(&plain(12, 15, [9; 3])));
        assert_eq!(composite.clone().cropped(Region { x: 30, ..region }).image(), composite.image());
    }

    #[test]
    fn pictures_are_reduced_to_fit() {
        let image = reduced(&plain(720, 480, [7, 8, 9]));
        assert_eq!(image, plain(360, 240, [7, 8, 9]));
        assert_eq!(reduced(&plain(3000, 1, [1; 3])), plain(375, 1, [1; 3]));
    }

    #[test]
    fn figure_2_holds_a_jpeg_of_each_experiment_that_has_photographs() {
        let green: Composite = [plain(720, 480, [20, 180, 40])].into_iter().collect();
        let Body::Jpegs(jpegs) = composite(&[green, Composite::default()], Plants::Real).body else {
            panic!()
        };
        assert_eq!(jpegs.len(), 1);
        let photo = Photo { name: String::new(), bytes: jpegs[0].clone(), time_s: 0.0 };
        let [red, green, blue] = photo.decode().unwrap().at(100, 100);
        assert!(red.abs_diff(20) < 6 && green.abs_diff(180) < 6 && blue.abs_diff(40) < 6);
    }
}
