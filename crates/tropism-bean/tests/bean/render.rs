//! Pictures of the virtual tent.

use proptest::prelude::*;
use tropism::geometry::Point;
use tropism::lamps::{Colour, Lamp, Layout, Light};
use tropism::math;
use tropism::photo::{Image, Photo};
use tropism_bean::pose::{Leaf, Node, Pose};
use tropism_bean::render::{Renderer, truth};
use tropism_bean::scene::Scene;
use tropism_bean::view::Frame;

/// A stem of constant curvature that ends `bend` rad off the vertical, with leaves that start 1 cm below its apex.
fn bean(length: f64, bend: f64, spread: f64) -> Pose {
    let segments = 40;
    let mut stem = vec![Node { at: [0.0; 3], radius: 0.17 }];
    let heading = |share: f64| [math::sin(bend * share), math::cos(bend * share), 0.0];
    for segment in 0..segments {
        let share = (f64::from(segment) + 0.5) / f64::from(segments);
        let step = heading(share).map(|part| part * length / f64::from(segments));
        let last = stem[segment as usize].at;
        stem.push(Node {
            at: core::array::from_fn(|axis| last[axis] + step[axis]),
            radius: 0.17 - 0.06 * share,
        });
    }
    let leaf = |sign: f64| Leaf {
        base: stem[(stem.len() - 1).saturating_sub((f64::from(segments) / length) as usize)].at,
        along: if spread > 0.5 { [0.8 * sign, 0.1, 0.59 * sign] } else { heading(1.0) },
        across: if spread > 0.5 { [0.59 * sign, 0.0, -0.8 * sign] } else { [0.0, 0.0, 1.0] },
        length: if spread > 0.5 { 3.5 } else { 0.8 },
    };
    Pose { age_h: 30.0, heading: heading(1.0), leaves: [leaf(1.0), leaf(-1.0)], spread, withered: 0.2, stem }
}

fn luma([red, green, blue]: [u8; 3]) -> f64 {
    0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)
}

/// The first row, from the top, of the region between the lamps and above the pot that holds a pixel brighter than
/// `bright`, and the column of the brightest pixel in it.
fn highest(image: &Image, frame: Frame, bright: f64) -> Option<(usize, usize)> {
    let edge = frame.pixel(Point::new(20.0, 2.5));
    let columns = (image.width - 1 - edge.x as usize)..edge.x as usize;
    (0..edge.y as usize).find_map(|y| {
        let brightest =
            columns.clone().max_by(|&a, &b| luma(image.at(a, y)).total_cmp(&luma(image.at(b, y))))?;
        (luma(image.at(brightest, y)) > bright).then_some((brightest, y))
    })
}

#[test]
fn the_highest_bright_pixel_is_the_true_top() {
    let renderer = std::cell::RefCell::new(Renderer::new(&Scene::default(), 3));
    let lights = prop_oneof![Just(Light::LEFT), Just(Light::RIGHT)];
    proptest!(
        ProptestConfig::with_cases(50),
        |(length in 4.0..26.0_f64, bend in -1.1..1.1_f64, open in any::<bool>(), light in lights)| {
            let pose = bean(length, bend, if open { 1.0 } else { 0.0 });
            let mut renderer = renderer.borrow_mut();
            let image = renderer.draw(&pose, Some(light), true, 0);
            let frame = renderer.frame();
            let top = frame.pixel(truth(&pose, frame).top);
            let (_, y) = highest(&image, frame, 85.0).expect("the plant is bright");
            // Folded leaves end in a point, whose last pixels are as dark as the cloth behind them.
            let within = if open { 1.5 } else { 2.5 };
            prop_assert!((y as f64 - top.y).abs() < within, "row {y}, true {}", top.y);
        }
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn a_picture_does_not_depend_on_what_was_drawn_before(first in 0..1000_u64, second in 0..1000_u64) {
        let scene = Scene { width: 160, height: 120, ..Scene::default() };
        let pose = bean(9.0, 0.3, 0.0);
        let mut renderer = Renderer::new(&scene, 5);
        let alone = Renderer::new(&scene, 5).draw(&pose, Some(Light::LEFT), true, second);
        let _ = renderer.draw(&bean(12.0, -0.3, 1.0), Some(Light::RIGHT), true, first);
        let _ = renderer.draw(&pose, None, false, first);
        prop_assert_eq!(renderer.draw(&pose, Some(Light::LEFT), true, second), alone);
    }
}

#[test]
fn only_the_plant_is_bright_between_the_lamps() {
    let empty = Pose { age_h: 100.0, withered: 1.0, ..bean(1.0, 0.0, 0.0) };
    for (seed, lit) in [(11, None), (12, Some(Light::LEFT)), (13, Some(Light::RIGHT)), (14, None)] {
        let mut renderer = Renderer::new(&Scene::default(), seed);
        let image = renderer.draw(&empty, lit, true, 0);
        assert_eq!(highest(&image, renderer.frame(), 85.0), None, "{seed} {lit:?}");
        let bean = renderer.draw(&bean(20.0, 0.2, 0.0), lit, true, 0);
        for row in 260..380 {
            let brightest = (250..420).map(|x| luma(bean.at(x, row))).fold(0.0, f64::max);
            assert!(brightest > 120.0, "{brightest} in row {row}");
        }
    }
}

#[test]
fn the_lit_lamp_is_the_brightest_thing_and_without_lights_it_is_dark() {
    let mut renderer = Renderer::new(&Scene::default(), 2);
    let pose = bean(10.0, 0.0, 0.0);
    for light in Light::BOTH {
        let image = renderer.draw(&pose, Some(light), true, 0);
        let frame = renderer.frame();
        let at = |light: Light| {
            let pixel = frame.pixel(Point::new(31.6 * Layout::default().side(light), 29.0));
            luma(image.at(pixel.x as usize, pixel.y as usize))
        };
        assert!(at(light) > 250.0 && at(Layout::default().mirrored(light).unwrap()) < 180.0, "{light}");
    }
    let dark = renderer.draw(&pose, None, false, 0);
    assert!(dark.rgb.iter().all(|&byte| byte < 30));
}

#[test]
fn a_lamp_shines_in_its_colour() {
    let under = |colour| {
        let [left, right] = [Lamp::new("left", [-35.0, 10.0, 0.0]), Lamp::new("right", [35.0, 10.0, 0.0])];
        let layout = Layout::new(vec![left, right.with_colour(colour)]).unwrap();
        let mut renderer = Renderer::new(&Scene::default(), 2).under(&layout);
        let image = renderer.draw(&bean(10.0, 0.0, 0.0), Some(Light::RIGHT), false, 0);
        // What is not clipped.
        let soft = image.rgb.chunks_exact(3).filter(|rgb| rgb.iter().all(|&byte| byte < 200));
        let sum = |band: usize| soft.clone().map(|rgb| f64::from(rgb[band])).sum::<f64>();
        sum(0) / sum(2)
    };
    let [blue, white, red] = [Colour::Blue, Colour::White, Colour::Red].map(under);
    assert!(blue < 0.5 && (0.3..2.0).contains(&white) && red > 2.0, "{blue} {white} {red}");
}

#[test]
fn noise_differs_between_photographs_and_the_file_decodes_to_the_picture() {
    let mut renderer = Renderer::new(&Scene::default(), 4);
    let pose = bean(10.0, 0.4, 1.0);
    let image = renderer.draw(&pose, Some(Light::LEFT), true, 7);
    assert_ne!(image, renderer.draw(&pose, Some(Light::LEFT), true, 8));
    let bytes = renderer.photograph(&pose, Some(Light::LEFT), true, 7);
    let decoded = Photo { name: "0007.jpg".to_owned(), bytes, time_s: 0.0 }.decode().unwrap();
    let off = |(&a, &b): (&u8, &u8)| f64::from(a.abs_diff(b));
    let mean = image.rgb.iter().zip(&decoded.rgb).map(off).sum::<f64>() / image.rgb.len() as f64;
    assert!(mean < 3.0, "{mean}");
}

#[test]
fn a_plant_outside_the_picture_leaves_the_tent_as_it_is() {
    let mut renderer = Renderer::new(&Scene::default(), 4);
    let mut away = bean(10.0, 0.0, 0.0);
    let shift = |at: &mut math::vector::Vec3| at[0] += 500.0;
    away.stem.iter_mut().for_each(|node| shift(&mut node.at));
    away.leaves.iter_mut().for_each(|leaf| shift(&mut leaf.base));
    let mut further = away.clone();
    further.stem.iter_mut().for_each(|node| shift(&mut node.at));
    further.leaves.iter_mut().for_each(|leaf| shift(&mut leaf.base));
    assert_eq!(renderer.draw(&away, None, true, 0), renderer.draw(&further, None, true, 0));
}
