//! Image effects of optical faults. Sizes and strengths are chosen by hand to look like photographs of real tents.

use rand::Rng;
use tropism::geometry::Pixel;
use tropism::math;
use tropism::math::vector::{add, scale};
use tropism::photo::Image;
use tropism::random::uniform;

use crate::pose::{Leaf, Pose};
use crate::render::blurred;
use crate::view::View;

fn between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    math::interpolate::lerp(low, high, uniform(rng))
}

/// Hangs one of the leaves, face on to the camera, in front of the apex.
pub(super) fn leaf_across(pose: &mut Pose, view: View, rng: &mut impl Rng) {
    let slant = between(rng, -0.5, 0.5);
    let side = if uniform(rng) < 0.5 { 1.0 } else { -1.0 };
    let along = view.to_tent([side * math::cos(slant), math::sin(slant), 0.0]);
    let across = view.to_tent([-math::sin(slant), side * math::cos(slant), 0.0]);
    let length = pose.leaves[1].length.max(3.5);
    let in_front = add(pose.apex(), view.to_tent([0.0, 0.0, 1.0]));
    pose.leaves[1] = Leaf { base: add(in_front, scale(along, -0.6 * length)), along, across, length };
    pose.spread = 1.0;
}

/// Shifts the picture by 0.4 to 1.6 cm along each axis, as a displaced camera does.
pub(super) fn nudged(image: &mut Image, px_per_cm: f64, rng: &mut impl Rng) {
    let mut shift = || {
        let far = between(rng, 0.4, 1.6) * px_per_cm;
        (if uniform(rng) < 0.5 { far } else { -far }).round() as isize
    };
    let (right, down) = (shift(), shift());
    let source = image.clone();
    let inside = |value: isize, size: usize| value.clamp(0, size as isize - 1) as usize;
    for y in 0..image.height {
        for x in 0..image.width {
            let from_x = inside(x as isize - right, image.width);
            let from_y = inside(y as isize - down, image.height);
            let at = 3 * (y * image.width + x);
            image.rgb[at..at + 3].copy_from_slice(&source.at(from_x, from_y));
        }
    }
}

/// Calls `change` with each pixel within `reach` pixels of `centre`, and its offset from it.
fn around(image: &mut Image, centre: Pixel, reach: f64, mut change: impl FnMut(&mut [u8], f64, f64)) {
    let span = |middle: f64, size: usize| {
        let low = (middle - reach).max(0.0) as usize;
        low.min(size)..((middle + reach).max(0.0) as usize + 1).min(size)
    };
    for y in span(centre.y, image.height) {
        for x in span(centre.x, image.width) {
            let at = 3 * (y * image.width + x);
            change(&mut image.rgb[at..at + 3], x as f64 - centre.x, y as f64 - centre.y);
        }
    }
}

/// Lens flare over the tip: a blue-white ghost of a lamp with a streak.
pub(super) fn glare(image: &mut Image, top: Pixel, px_per_cm: f64, rng: &mut impl Rng) {
    let wide = between(rng, 1.5, 3.5) * px_per_cm;
    let strength = between(rng, 150.0, 320.0);
    let slant = between(rng, -0.4, 0.4);
    let centre = Pixel::new(top.x + between(rng, -0.4, 0.4) * wide, top.y + between(rng, -0.4, 0.4) * wide);
    around(image, centre, 6.0 * wide, |pixel, x, y| {
        let round = math::exp(-(x * x + y * y) / (wide * wide));
        let off = (y - slant * x) / (0.12 * wide);
        let streak = 0.5 * math::exp(-off * off - x.abs() / (1.5 * wide));
        for (byte, tint) in pixel.iter_mut().zip([0.72, 0.88, 1.0]) {
            *byte = byte.saturating_add((strength * tint * (round + streak)).min(255.0) as u8);
        }
    });
}

/// The shadow of a fly on the lens, far out of focus, near the middle of the picture or near the tip.
pub(super) fn fly(image: &mut Image, top: Pixel, px_per_cm: f64, rng: &mut impl Rng) {
    let long = between(rng, 1.8, 4.0) * px_per_cm;
    let away = between(rng, 0.0, 1.0);
    let centre = Pixel::new(
        top.x + away * between(rng, -12.0, 12.0) * px_per_cm,
        top.y + away * between(rng, -8.0, 8.0) * px_per_cm,
    );
    let turn = between(rng, 0.0, core::f64::consts::PI);
    let (c, s) = (math::cos(turn), math::sin(turn));
    around(image, centre, 3.0 * long, |pixel, x, y| {
        let (ahead, aside) = ((x * c + y * s) / long, (y * c - x * s) / long);
        let body = math::exp(-(ahead * ahead + 4.0 * aside * aside) * 1.4);
        // Six legs: three lines across the body, fading outwards.
        let spread = (ahead - 0.45 * (ahead / 0.45).round().clamp(-1.0, 1.0)) / 0.09;
        let legs = 0.55 * math::exp(-spread * spread - aside * aside);
        let through = 1.0 - 0.94 * (body + legs).min(1.0);
        for byte in pixel {
            *byte = (f64::from(*byte) * through) as u8;
        }
    });
}

/// Mist on the lens, from 0 (none) to 1 (thick): blur and a grey veil.
pub(super) fn condensation(image: &mut Image, px_per_cm: f64, thick: f64) {
    let misty = blurred(image, (0.1 + 0.5 * thick) * px_per_cm);
    for (byte, mist) in image.rgb.iter_mut().zip(misty.rgb) {
        let seen = f64::from(*byte) + (0.5 + 0.45 * thick) * (f64::from(mist) - f64::from(*byte));
        *byte = (seen + thick * 0.12 * (140.0 - seen)) as u8;
    }
}
