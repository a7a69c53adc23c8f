//! Lines of stems that are learned from clicks.

use tropism::geometry::Pixel;
use tropism::geometry::path::share_nearest;
use tropism::math::vector::{between, distance};
use tropism::photo::Image;
use tropism::vision::detect::learned_stem::{KnownEnds, LearnedStem};

const SIZE: (usize, usize) = (220, 180);
const ROOT: Pixel = Pixel::new(110.0, 170.0);

/// A stem from the root to `lean` columns to the right of it.
fn truth(lean: f64) -> Vec<Pixel> {
    let at = |step: i32| {
        let share = f64::from(step) / 20.0;
        Pixel::new(ROOT.x + lean * share * share, ROOT.y - 140.0 * share)
    };
    (0..=20).map(at).collect()
}

fn distance_from(line: &[Pixel], at: Pixel) -> f64 {
    let to = |pair: &[Pixel]| {
        let [from, to, at] = [pair[0], pair[1], at].map(<[f64; 2]>::from);
        distance(at, between(from, to, share_nearest(from, to, at)))
    };
    line.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

/// The stem before a wall of patches whose edges are weaker than its own; rows that are `covered` show the wall.
fn picture(lean: f64, covered: std::ops::Range<usize>) -> Image {
    let line = truth(lean);
    let rgb = (0..SIZE.0 * SIZE.1).flat_map(|index| {
        let (x, y) = (index % SIZE.0, index / SIZE.0);
        let is_stem = !covered.contains(&y) && distance_from(&line, Pixel::new(x as f64, y as f64)) < 3.0;
        let patch = (x / 23 * 7919 + y / 19 * 104_729) % 3;
        let [r, g, b] = [[40, 40, 60], [80, 70, 70], [60, 80, 100]][patch];
        let noise = (index * 7919 % 11) as u8;
        if is_stem { [90 + noise, 150 + noise, 60 + noise] } else { [r + noise, g + noise, b + noise] }
    });
    Image { width: SIZE.0, height: SIZE.1, rgb: rgb.collect() }
}

fn known(picture: &Image, lean: f64) -> KnownEnds<'_> {
    KnownEnds { picture, root: ROOT, tip: truth(lean)[20] }
}

fn learned() -> LearnedStem {
    let leans = [-50.0, 5.0, 60.0];
    let pictures = leans.map(|lean| picture(lean, 0..0));
    let examples: Vec<_> = pictures.iter().zip(leans).map(|(picture, lean)| known(picture, lean)).collect();
    LearnedStem::learn(&examples).unwrap()
}

#[test]
fn a_line_is_right_before_a_busy_wall_and_unknown_where_the_stem_is_covered() {
    let stem = learned();
    for lean in [-35.0, 25.0, 45.0] {
        let [whole, covered] = [0..0, 60..130].map(|covered| {
            let picture = picture(lean, covered);
            stem.line(known(&picture, lean), truth(lean)[20]).unwrap()
        });
        let off = whole.line.iter().map(|&at| distance_from(&truth(lean), at)).fold(0.0, f64::max);
        assert!(off < 2.0 && whole.confidence > 0.7, "{lean}: {off} px, {}", whole.confidence);
        assert!(covered.confidence < 0.5, "{lean}: {}", covered.confidence);
    }
}

#[test]
fn the_same_pictures_give_the_same_bits() {
    let lines = std::array::from_fn::<_, 2, _>(|_| {
        let work = std::thread::spawn(|| learned().line(known(&picture(25.0, 0..0), 25.0), truth(25.0)[20]));
        work.join().unwrap()
    });
    assert!(lines[0].is_some() && lines[0] == lines[1]);
}

#[test]
fn nothing_is_learned_without_a_picture_and_no_line_leaves_it() {
    assert!(LearnedStem::learn(&[]).is_none());
    let picture = picture(0.0, 0..0);
    let one_place = KnownEnds { picture: &picture, root: ROOT, tip: ROOT };
    assert!(LearnedStem::learn(&[one_place]).is_none());
    let outside = KnownEnds { tip: Pixel::new(110.0, -40.0), ..known(&picture, 5.0) };
    assert_eq!(learned().line(outside, outside.tip), None);
}
