//! The checkerboard through drawn lenses.

use tropism::geometry::{Pixel, Point};
use tropism::photo::Image;
use tropism::random::{self, Purpose};
use tropism::vision::camera::checkerboard::Checkerboard;
use tropism::vision::camera::lens::Lens;

const BOARD: Checkerboard = Checkerboard { columns: 9, rows: 6, square_cm: 1.5 };

/// A photograph of the board through a lens: 10 x 7 squares on a white sheet before grey, with noise.
fn photograph(lens: &Lens, width: usize, height: usize, noise: f64) -> Image {
    let mut rng = random::stream(7, Purpose::Camera, 0);
    let level = |x: f64, y: f64| {
        let Point { x, y } = lens.point(Pixel::new(x, y), width, height);
        let (column, row) = ((x / 1.5 + 5.0).floor(), (y / 1.5 + 3.5).floor());
        let is_board = (0.0..10.0).contains(&column) && (0.0..7.0).contains(&row);
        let is_sheet = (-1.0..11.0).contains(&column) && (-1.0..8.0).contains(&row);
        let is_dark = (column + row).rem_euclid(2.0) < 0.5;
        if is_board && is_dark {
            25.0
        } else if is_sheet {
            220.0
        } else {
            90.0
        }
    };
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            let part = |i: usize| (i as f64 + 0.5) / 4.0 - 0.5;
            let at = |i: usize| level(x as f64 + part(i % 4), y as f64 + part(i / 4));
            // Where its corners have one level, a pixel has no edge in it.
            let is_plain = [3, 12, 15].iter().all(|&i| at(i) == at(0));
            let mean = if is_plain { at(0) } else { (0..16).map(at).sum::<f64>() / 16.0 };
            let value = mean + noise * random::normal(&mut rng);
            rgb.extend([value.clamp(0.0, 255.0) as u8; 3]);
        }
    }
    Image { width, height, rgb }
}

fn lens(distortion: f64, pitch: f64, turn: f64, roll: f64) -> Lens {
    let homography = [[18.0, 18.0 * roll, 0.2], [18.0 * roll, -18.0, 0.3], [turn, pitch, 1.0]];
    Lens { distortion, homography }
}

#[test]
fn a_board_gives_lens_and_perspective() {
    let (width, height) = (900, 675);
    for (distortion, pitch, turn, roll) in
        [(0.0, 0.0, 0.0, 0.0), (-0.15, 0.1, -0.05, 0.0), (-0.08, -0.1, 0.15, 0.1), (0.05, 0.05, 0.1, -0.2)]
    {
        let truth = lens(distortion, pitch, turn, roll);
        let image = photograph(&truth, width, height, 3.0);
        let corners = BOARD.find(&image).unwrap();
        assert_eq!(corners.len(), 54);
        let fit = Lens::fit(&corners, width, height).unwrap();
        assert!(fit.residual_px < 0.15 && fit.residual_mm < 0.1, "{fit:?}");
        // Lengths on the board and beyond it are right.
        let cm = |lens: &Lens, (a, b): (Pixel, Pixel)| {
            lens.point(a, width, height).distance(lens.point(b, width, height))
        };
        for ends in [(200, 300, 700, 320), (450, 150, 430, 560), (250, 200, 650, 500)] {
            let (a, b) = (ends.0, ends.1);
            let ends =
                (Pixel::new(f64::from(a), f64::from(b)), Pixel::new(f64::from(ends.2), f64::from(ends.3)));
            let (found, wanted) = (cm(&fit.lens, ends), cm(&truth, ends));
            assert!((found - wanted).abs() < 0.002 * wanted, "{found} cm, wanted {wanted} cm: {fit:?}");
        }
    }
}

#[test]
fn a_large_photograph_is_searched_downscaled_and_refined_at_full_size() {
    let truth = lens(-0.1, 0.05, 0.02, 0.0);
    let (width, height) = (1_800, 1_350);
    let corners = BOARD.find(&photograph(&truth, width, height, 0.0)).unwrap();
    for (pixel, _) in &corners {
        let at = truth.point(*pixel, width, height);
        let off =
            |cm: f64| (cm / 1.5 - (cm / 1.5 + 0.25).round()).abs().min((cm / 1.5 - (cm / 1.5).round()).abs());
        assert!(off(at.x) < 0.01, "{at:?}");
    }
}

#[test]
fn a_missing_board_is_an_error_that_counts_corners() {
    let truth = lens(0.0, 0.0, 0.0, 0.0);
    let image = photograph(&truth, 600, 450, 2.0);
    let error = Checkerboard { columns: 8, rows: 6, ..BOARD }.find(&image).unwrap_err();
    assert_eq!(error.found, 54);
    assert!(error.to_string().contains("found 54 inner corners of a checkerboard, wanted 8 x 6"));
    for (width, height) in [(0, 0), (1, 1), (3, 900), (60, 40)] {
        let grey = Image { width, height, rgb: vec![100; 3 * width * height] };
        assert_eq!(BOARD.find(&grey).unwrap_err().found, 0);
    }
}
