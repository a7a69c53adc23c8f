//! Figures, report pages and films of plant experiments, in the form of Wahby et al. 2016.
//!
//! In: tracks, photographs and numbers. Out: [`Figure`]s (SVG text or JPEG bytes), a [`Page`] of HTML that needs no other
//! file, and the pictures of a [`Film`]. All functions are pure: the same data give the same bytes. Colours in figures are
//! CSS classes, so that a figure is legible on light ground, on dark ground and in print.
//!
//! # References
//! Wahby, Hofstadler, Heinrich, Zahadat and Hamann 2016, Figures 2 to 9, doi:10.1109/SASO.2016.8.

mod font;
mod lamp;
mod picture;
mod overlay;
mod animation;
mod colour;
mod csv;
mod composite;
mod thinning;
mod plot;
mod drawing;
mod raster;
mod pdf;
mod setup;
mod over_time;
mod trajectories;
mod orthographic;
mod decision;
mod evolution;
mod film;
pub mod guide;
mod kinematics;
mod network;
mod page;
mod shifts;
mod speed;
mod stems;
mod transfer;
mod comparison;
mod forecast;
mod measure;
mod wall;

use std::collections::BTreeMap;

pub use animation::{Animation, AnimationError};
pub use colour::style;
pub use comparison::{ComparedRuns, fitness_compared, values_compared};
pub use composite::{Composite, composite};
pub use decision::{SteeredTrack, decision, decision_text, rule};
pub use evolution::{fitness_boxes, fitness_median_run, fitness_run};
pub use film::{Film, FilmStep};
pub use forecast::{ForecastErrors, ForecastPanel, forecast_errors};
pub use kinematics::{KinematicValue, kinematics};
pub use measure::{MeasuredPlant, fitted_stems, kymographs, ridge, strips};
pub use network::{network, network_dot, too_large_to_draw};
pub use orthographic::{Surroundings, in_space};
pub use over_time::over_time;
pub use overlay::{OverlayMarks, contact_sheet, draw_overlay};
pub use page::{LeftOut, NumberRow, Page, Table};
pub use picture::{cropped, scaled};
pub use setup::{SetUp, setup};
pub use shifts::shift_maps;
pub use speed::speed;
pub use stems::{LitStem, stems};
pub use trajectories::{Goals, directions, steering, trajectories};
pub use transfer::{ControllerScores, SteeredPlant, score_strips, steering_panels};
pub use wall::{WallPlant, wall};

/// The kind of plants that results come from. Every caption and every page names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plants {
    /// Living plants.
    Real,
    /// Virtual plants in the virtual tent.
    Virtual,
    /// Simulation by a tip-motion model of living plants.
    ModelOfReal,
    /// Simulation by a tip-motion model of virtual plants.
    ModelOfVirtual,
}

impl Plants {
    /// Whether the results come, directly or through a model, from virtual plants.
    #[must_use]
    pub const fn is_virtual(self) -> bool {
        matches!(self, Self::Virtual | Self::ModelOfVirtual)
    }

    /// The sentence that ends a caption.
    #[must_use]
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Real => "The plants are real.",
            Self::Virtual => "The plants are virtual.",
            Self::ModelOfReal => "In simulation: a model of real plants.",
            Self::ModelOfVirtual => "In simulation: a model of virtual plants.",
        }
    }
}

/// A numbered figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The paper's number, such as `4a`.
    pub number: &'static str,
    /// Title.
    pub title: String,
    /// Caption; its last sentence is [`Plants::sentence`].
    pub caption: String,
    /// The numbers that it draws, as CSV; empty where there are none beside the tracks themselves.
    pub data: String,
    /// Drawing or pictures.
    pub body: Body,
}

/// The drawing or the pictures of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// One `<svg>` whose colours are the classes of the page's style sheet.
    Svg(String),
    /// JPEG pictures, side by side.
    Jpegs(Vec<Vec<u8>>),
    /// A plant in space.
    Space {
        /// The plant from the front, from the side and from above, as one `<svg>`.
        svg: String,
        /// What a page draws while its reader turns the plant, as JSON.
        scene: String,
    },
}

impl Body {
    /// The drawing; `None` for pictures.
    #[must_use]
    pub fn svg(&self) -> Option<&str> {
        match self {
            Self::Svg(svg) | Self::Space { svg, .. } => Some(svg),
            Self::Jpegs(_) => None,
        }
    }
}

impl Figure {
    /// Names and bytes of the figure as files: `figure-4a.svg` in the colours of light ground, which every viewer of SVG draws,
    /// the same as PNG and PDF, or `figure-2-1.jpg` and so on; and `figure-4a.csv` with its data.
    #[must_use]
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        self.files_named(self.number)
    }

    fn files_named(&self, number: &str) -> Vec<(String, Vec<u8>)> {
        let mut files: Vec<(String, Vec<u8>)> = match &self.body {
            Body::Svg(svg) | Body::Space { svg, .. } => {
                let (head, rest) = svg.split_once('>').unwrap_or((svg, ""));
                let style = colour::plain_style();
                let (width, height) = plot::size(svg);
                let file = format!(
                    "{} xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\"><style>{style}</style>\
                     <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>{rest}\n",
                    head.trim_end()
                );
                let drawing = drawing::Drawing::of(svg);
                let svg = Some((format!("figure-{number}.svg"), file.into_bytes()));
                let png = raster::png(&drawing).map(|png| (format!("figure-{number}.png"), png));
                let pdf = Some((format!("figure-{number}.pdf"), pdf::pdf(&drawing)));
                [svg, png, pdf].into_iter().flatten().collect()
            }
            Body::Jpegs(jpegs) => (1..)
                .zip(jpegs)
                .map(|(index, jpeg)| (format!("figure-{number}-{index}.jpg"), jpeg.clone()))
                .collect(),
        };
        if !self.data.is_empty() {
            files.push((format!("figure-{number}.csv"), self.data.clone().into_bytes()));
        }
        files
    }
}

/// Names and bytes of the files of all figures. Of two with one number the second has the names `figure-8-b.svg` and so on.
#[must_use]
pub fn files(figures: &[Figure]) -> Vec<(String, Vec<u8>)> {
    figures
        .iter()
        .zip(names(figures))
        .map(|(figure, name)| figure.files_named(&name))
        .collect::<Vec<_>>()
        .concat()
}

/// A name for each figure, as in the names of its files: its number, and for the second of one number `8-b` and so on.
#[must_use]
pub fn names(figures: &[Figure]) -> Vec<String> {
    let mut seen: BTreeMap<&str, u8> = BTreeMap::new();
    let name = |figure: &Figure, copy: u8| match copy {
        0 => figure.number.to_owned(),
        1..26 => format!("{}-{}", figure.number, char::from(b'a' + copy)),
        _ => format!("{}-{}", figure.number, u16::from(copy) + 1),
    };
    let named = figures.iter().map(|figure| {
        let copies = seen.entry(figure.number).or_default();
        let name = name(figure, *copies);
        *copies = copies.saturating_add(1);
        name
    });
    named.collect()
}

/// Figures as one SVG file with its style sheet, in rows of at most 960 pixels. Figures of JPEG pictures are left out.
#[must_use]
pub fn in_one_svg(figures: &[Figure]) -> String {
    const GAP: f64 = 24.0;
    const WIDEST: f64 = 960.0;
    let (mut place, mut row, mut width, mut panels) = ((0.0, 0.0), 0.0_f64, 0.0_f64, String::new());
    for figure in figures {
        let Some(svg) = figure.body.svg() else { continue };
        let (wide, high) = plot::size(svg);
        if place.0 > 0.0 && place.0 + wide > WIDEST {
            place = (0.0, place.1 + row + GAP);
            row = 0.0;
        }
        let (x, y) = place;
        let frame = format!("<svg x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{high}\"");
        panels += &svg.replacen("<svg", &frame, 1);
        width = width.max(x + wide);
        row = row.max(high);
        place.0 += wide + GAP;
    }
    let (style, height) = (colour::style(), place.1 + row);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\"><style>{style}</style>{panels}</svg>\n"
    )
}

#[cfg(test)]
mod testing;

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::geometry::Point;
    use tropism::track::Track;

    fn all(tracks: &[Track], runs: &[Vec<f64>]) -> Vec<Figure> {
        let empty = Track::default();
        let first = tracks.first().unwrap_or(&empty);
        let best = runs.first().map_or(&[][..], Vec::as_slice);
        let goals = Goals { targets: vec![Point::new(3.0, 6.0)], ..Goals::default() };
        let mut figures = vec![
            composite(&[], Plants::Real),
            speed(tracks, Plants::Real),
            trajectories(tracks, Plants::Real),
            directions(tracks, Plants::Real),
            fitness_boxes(runs, "cm", Plants::ModelOfReal),
            fitness_run(0, "one of all", [best, best], "cm", Plants::ModelOfReal),
            steering("8", "Reality", first, &goals, (-3.25, Some(15.0)), Plants::Real),
            steering("8", "Reality", first, &Goals::default(), (0.0, None), Plants::Real),
            over_time(tracks, &[], Plants::Real),
        ];
        figures.extend(shift_maps(tracks, Plants::Real));
        figures
    }

    #[test]
    fn degenerate_data_still_make_figures() {
        let one = testing::track(&[(0.0, 4.0, '-')]);
        let still = testing::track(&[(0.0, 4.0, 'l'); 5]);
        let huge = testing::track(&[(-1e300, 4.0, 'l'), (1e300, 1e-300, 'r'), (0.0, -1e300, 'r')]);
        let cases: [(&[Track], &[Vec<f64>]); 6] = [
            (&[], &[]),
            (&[Track::default()], &[vec![]]),
            (&[one], &[vec![1.0]]),
            (&[still], &[vec![0.0, 0.0], vec![1.0]]),
            (&[huge], &[vec![-1e300, 1e300]]),
            (&testing::swings(9, 40), &[vec![f64::NAN, f64::INFINITY, 3.0]]),
        ];
        for (tracks, runs) in cases {
            for figure in all(tracks, runs) {
                if let Body::Svg(svg) = &figure.body {
                    testing::assert_well_formed(svg);
                    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{}: {svg}", figure.number);
                }
            }
        }
    }

    #[test]
    fn files_of_figures_need_no_variables_of_css() {
        for figure in all(&testing::swings(3, 60), &[vec![1.0, 2.0]]) {
            let files = figure.files();
            let starts = |end: &str| {
                let file = files.iter().find(|(name, _)| name.ends_with(end));
                file.map(|(_, bytes)| String::from_utf8_lossy(&bytes[..8]).into_owned())
            };
            let is_drawn = matches!(figure.body, Body::Svg(_));
            assert_eq!(starts(".pdf").is_some_and(|start| start == "%PDF-1.7"), is_drawn);
            assert_eq!(starts(".png").is_some_and(|start| start.ends_with("PNG\r\n\u{1a}\n")), is_drawn);
            let Some((_, bytes)) = files.iter().find(|(name, _)| name.ends_with(".svg")) else { continue };
            let text = String::from_utf8(bytes.clone()).unwrap();
            assert!(!text.contains("var(") && !text.contains("--") && !text.contains("@media"), "{text}");
            assert!(text.contains(" width=\"") && text.contains("{fill:#5b636b}"), "{text}");
            let Some((_, data)) = files.iter().find(|(name, _)| name.ends_with(".csv")) else { continue };
            let data = String::from_utf8(data.clone()).unwrap();
            let columns = data.lines().next().unwrap().split(',').count();
            assert!(data.lines().all(|line| line.split(',').count() == columns), "{data}");
        }
        let figure = trajectories(&testing::swings(2, 3), Plants::Real);
        assert!(
            figure
                .data
                .starts_with("plant,step,time_h,tip_x_cm,tip_y_cm,light\n1,0,0.0000,0.0000,4.0000,left\n")
        );
        assert_eq!(figure.data.lines().count(), 9);
    }

    #[test]
    fn figures_of_one_number_have_files_of_their_own() {
        let figure = trajectories(&testing::swings(1, 3), Plants::Real);
        let files = files(&[figure.clone(), figure]);
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        let ends = ["svg", "png", "pdf", "csv"];
        let wanted =
            [ends.map(|end| format!("figure-4a.{end}")), ends.map(|end| format!("figure-4a-b.{end}"))];
        assert_eq!(names, wanted.concat());
    }

    #[test]
    fn every_letter_of_a_figure_is_in_the_font() {
        let tracks = testing::swings(3, 60);
        for figure in all(&tracks, &[vec![1.0, 2.0]]) {
            let Body::Svg(svg) = &figure.body else { continue };
            for text in svg.split("<text").skip(1).filter_map(|piece| piece.split(['<', '>']).nth(1)) {
                let font = font::Font::weighing(false);
                assert!(text.chars().all(|letter| font.glyph(letter) != 0), "{text}");
            }
        }
    }

    #[test]
    fn figures_of_long_tracks_are_small() {
        let mut state = 1_u64;
        let mut next = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        // Noise over the panel and far beyond it, under lamps that change at every step or seldom.
        let rows_in_all = 60_000;
        for (width, swing) in [(28.0, 1), (28.0, 300), (1e5, 300), (1e300, 7)] {
            let row = |step: usize| {
                let light = if (step / swing).is_multiple_of(2) { 'l' } else { 'r' };
                (width * (next() - 0.5), width * next(), light)
            };
            let rows: Vec<(f64, f64, char)> = (0..rows_in_all).map(row).collect();
            let track = testing::track(&rows);
            for figure in all(&[track], &[]) {
                let (number, bytes) = (figure.number, figure.data.len());
                assert!(bytes < 100 * rows_in_all, "{number} of {width}, {swing}: {bytes} bytes of data");
                if let Body::Svg(svg) = &figure.body {
                    assert!(
                        svg.len() < 1_000_000,
                        "{} of {width}, {swing}: {} bytes",
                        figure.number,
                        svg.len()
                    );
                    testing::assert_well_formed(svg);
                }
            }
        }
    }

    #[test]
    fn figures_of_one_file_are_in_rows() {
        let tracks = testing::swings(2, 20);
        let figure = trajectories(&tracks, Plants::Real);
        let Body::Svg(svg) = &figure.body else { panic!() };
        let (wide, high) = plot::size(svg);
        let all = in_one_svg(&[figure.clone(), figure.clone(), figure]);
        testing::assert_well_formed(&all);
        assert_eq!(plot::size(&all), (2.0 * wide + 24.0, 2.0 * high + 24.0));
        for place in [(0.0, 0.0), (wide + 24.0, 0.0), (0.0, high + 24.0)] {
            assert!(all.contains(&format!("<svg x=\"{}\" y=\"{}\"", place.0, place.1)), "{place:?}");
        }
        testing::assert_well_formed(&in_one_svg(&[]));
    }

    #[test]
    fn captions_name_the_kind_of_plants() {
        let tracks = testing::swings(2, 20);
        for figure in shift_maps(&tracks, Plants::Virtual).iter().chain(&[speed(&tracks, Plants::Virtual)]) {
            assert!(figure.caption.ends_with("The plants are virtual."));
        }
        for figure in all(&tracks, &[vec![1.0]]) {
            assert!(figure.caption.contains("real"), "{}", figure.caption);
        }
    }
}
