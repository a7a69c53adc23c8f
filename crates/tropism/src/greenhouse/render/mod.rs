//! Renders photographs of the virtual tent.
//!
//! In: a [`Pose`] and the state of the lights. Out: a picture or a JPEG file. The idea: only the plant moves, so the background
//! is ray-cast once for each state of the lights. A photograph costs a copy of it, the painted plant, sensor noise, and the
//! JPEG encoder.

mod body;
mod cloth;
mod tone;
mod paint;
mod solids;
mod background;
mod ycbcr;
mod jpeg;
mod sensor;
mod truth;

use self::background::Background;
use self::body::Body;
use self::paint::Canvas;
use self::sensor::{Blur, Noise};
use self::tone::ToneCurve;
pub use self::truth::{Truth, truth};
use self::ycbcr::YcbcrImage;
use super::pose::Pose;
use super::scene::{Lighting, Scene};
use super::view::{Frame, View};
use crate::lamps::{Layout, Light};
use crate::math::interpolate::bilinear;
use crate::obstacle::Solid;
use crate::photo::Image;

/// A camera in front of a virtual tent.
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Scene,
    view: View,
    background: Background,
    tone: ToneCurve,
    blur: Blur,
    noise: Noise,
    layout: Layout,
    /// Cached background of each state of the lights: dark, then each lamp; without and with flash.
    backgrounds: Vec<Option<YcbcrImage>>,
    /// Reused memory of the next photograph: allocation costs more than filling it.
    film: YcbcrImage,
}

impl Renderer {
    /// The front camera of a tent; `seed` selects the folds of its cloth and the sensor noise.
    ///
    /// The scene must have passed [`Scene::check`].
    #[must_use]
    pub fn new(scene: &Scene, seed: u64) -> Self {
        Self::at(View::Front, scene, seed)
    }

    /// [`Self::new`] for the camera of `view` in the same tent.
    #[must_use]
    pub fn at(view: View, scene: &Scene, seed: u64) -> Self {
        // Each camera has its own sensor noise and sees another cloth.
        let seed = seed ^ ((view as u64) << 63);
        Self {
            view,
            background: Background::new(scene, &Layout::default(), seed, view),
            tone: ToneCurve::new(),
            blur: Blur::new(scene.blur * scene.frame().px_per_cm),
            noise: Noise::new(seed, scene.noise, scene.width as usize),
            backgrounds: Vec::new(),
            film: YcbcrImage::default(),
            scene: scene.clone(),
            layout: Layout::default(),
        }
    }

    /// The same camera in a tent with the lamps of `layout`; without this, with the paper's two.
    ///
    /// A lamp behind the back wall stands in an opening of the cloth. A lamp in front of the plant occludes it.
    #[must_use]
    pub fn under(mut self, layout: &Layout) -> Self {
        self.background.set_lamps(layout);
        self.backgrounds.clear();
        self.layout = layout.clone();
        self
    }

    /// The same camera in a tent with `solids`; without this, with none.
    ///
    /// They are of wood, sheets of metal. They occlude what of the plant is behind them, and shade the walls.
    #[must_use]
    pub fn among(mut self, solids: &[Solid]) -> Self {
        self.background.set_solids(solids);
        self.backgrounds.clear();
        self
    }

    /// The view of the camera.
    #[must_use]
    pub const fn view(&self) -> View {
        self.view
    }

    /// How the photographs map the plane of the pot's axis to pixels.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.scene.frame()
    }

    /// Ground truth of a photograph of `pose`.
    #[must_use]
    pub fn truth(&self, pose: &Pose) -> Truth {
        truth(&pose.seen_from(self.view), self.frame())
    }

    /// The picture of `pose` with one lamp `lit` or none, taken with or without the flash.
    ///
    /// The picture depends on the arguments alone; `frame_index` selects the noise.
    #[must_use]
    pub fn draw(&mut self, pose: &Pose, lit: Option<Light>, flash: bool, frame_index: u64) -> Image {
        self.expose(pose, lit, flash, frame_index);
        self.film.picture()
    }

    /// The same picture as [`Self::draw`] gives, as the bytes of a JPEG file.
    #[must_use]
    pub fn photograph(&mut self, pose: &Pose, lit: Option<Light>, flash: bool, frame_index: u64) -> Vec<u8> {
        self.expose(pose, lit, flash, frame_index);
        jpeg::encode(&self.film, self.scene.jpeg_quality)
    }

    fn expose(&mut self, pose: &Pose, lit: Option<Light>, flash: bool, frame_index: u64) {
        let lighting = Lighting::new(&self.scene, &self.layout, lit, flash, self.view);
        let mut film = std::mem::take(&mut self.film);
        film.clone_from(self.background(&lighting, flash));
        let margin = self.blur.reach() as i64 + 1;
        let body = Body::new(&pose.seen_from(self.view));
        if let Some(mut canvas) = Canvas::paint(&body, self.frame(), margin, &lighting, &self.tone) {
            let columns = canvas.pixmap.width() as usize;
            self.blur.apply(canvas.pixmap.data_mut(), columns, 4);
            self.background.mask(&body, &mut canvas);
            film.lay_over(&canvas);
        }
        self.noise.add(&mut film.luma, film.width, frame_index);
        self.film = film;
    }

    /// A picture as the bytes of a JPEG file, of the scene's quality and with colour at half resolution, as cameras
    /// write it.
    ///
    /// # Panics
    /// If the picture has a side of 0 or above 65 535.
    #[must_use]
    pub fn encode(&self, image: &Image) -> Vec<u8> {
        jpeg::encode(&YcbcrImage::of(image), self.scene.jpeg_quality)
    }

    fn background(&mut self, lighting: &Lighting, flash: bool) -> &YcbcrImage {
        let state = 2 * lighting.lit().map_or(0, |light| 1 + light.index()) + usize::from(flash);
        let Self { scene, background, tone, blur, backgrounds, layout, .. } = self;
        backgrounds.resize(2 * (1 + layout.len()), None);
        backgrounds[state].get_or_insert_with(|| {
            let (width, height) = (scene.width as usize, scene.height as usize);
            let mut rgb = background.photograph(scene, lighting, tone);
            blur.apply(&mut rgb, width, 3);
            YcbcrImage::of(&Image { width, height, rgb })
        })
    }
}

/// Gaussian blur by `sigma` pixels. A wide blur works on a downsampled picture.
pub(super) fn blurred(image: &Image, sigma: f64) -> Image {
    let step = ((0.5 * sigma) as usize).max(1);
    let (width, height) = (image.width.div_ceil(step), image.height.div_ceil(step));
    let mut small = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let (x, y) = (column * step, row * step);
            let block = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| {
                let half = step / 2;
                image.at((x + right * half).min(image.width - 1), (y + down * half).min(image.height - 1))
            });
            small.extend(
                (0..3).map(|band| (block.iter().map(|rgb| u16::from(rgb[band])).sum::<u16>() / 4) as u8),
            );
        }
    }
    Blur::new(sigma / step as f64).apply(&mut small, width, 3);
    let small = Image { width, height, rgb: small };
    let along = |at: usize, size: usize| {
        let place = (at as f64 / step as f64 - 0.25).clamp(0.0, size as f64 - 1.0);
        (place as usize, (place as usize + 1).min(size - 1), place - place.floor())
    };
    let mut rgb = Vec::with_capacity(image.rgb.len());
    for y in 0..image.height {
        let (above, below, down) = along(y, height);
        for x in 0..image.width {
            let (left, right, across) = along(x, width);
            let corners = [(left, above), (right, above), (left, below), (right, below)]
                .map(|(x, y)| small.at(x, y).map(f64::from));
            rgb.extend((0..3).map(|band| bilinear(corners.map(|rgb| rgb[band]), across, down).round() as u8));
        }
    }
    Image { width: image.width, height: image.height, rgb }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::greenhouse::pose::{Leaf, Node};
    use crate::math;
    use crate::photo::Photo;

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
        Pose {
            age_h: 30.0,
            heading: heading(1.0),
            leaves: [leaf(1.0), leaf(-1.0)],
            spread,
            withered: 0.2,
            stem,
        }
    }

    fn luma([red, green, blue]: [u8; 3]) -> f64 {
        0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)
    }

    /// The first row, from the top, of the region between the lamps and above the pot that holds a pixel brighter than
    /// `bright`, and the column of the brightest pixel in it.
    fn highest(image: &Image, frame: Frame, bright: f64) -> Option<(usize, usize)> {
        let edge = frame.pixel(crate::geometry::Point::new(20.0, 2.5));
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
                let pixel =
                    frame.pixel(crate::geometry::Point::new(31.6 * Layout::default().side(light), 29.0));
                luma(image.at(pixel.x as usize, pixel.y as usize))
            };
            assert!(at(light) > 250.0 && at(Layout::default().mirrored(light).unwrap()) < 180.0, "{light}");
        }
        let dark = renderer.draw(&pose, None, false, 0);
        assert!(dark.rgb.iter().all(|&byte| byte < 30));
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
        let shift = |at: &mut crate::math::vector::Vec3| at[0] += 500.0;
        away.stem.iter_mut().for_each(|node| shift(&mut node.at));
        away.leaves.iter_mut().for_each(|leaf| shift(&mut leaf.base));
        let mut further = away.clone();
        further.stem.iter_mut().for_each(|node| shift(&mut node.at));
        further.leaves.iter_mut().for_each(|leaf| shift(&mut leaf.base));
        assert_eq!(renderer.draw(&away, None, true, 0), renderer.draw(&further, None, true, 0));
    }
}
