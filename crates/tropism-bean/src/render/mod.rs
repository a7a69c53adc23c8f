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
mod node;

use tropism::lamps::Layout;
use tropism::lighting::Lighting;
use tropism::math::interpolate::bilinear;
use tropism::obstacle::Solid;
use tropism::photo::Image;

use self::background::Background;
use self::body::Body;
pub use self::node::{NodeCamera, NodeCameras};
use self::paint::Canvas;
use self::sensor::{Blur, Noise};
use self::tone::ToneCurve;
pub use self::truth::{Truth, truth};
use self::ycbcr::YcbcrImage;
use super::pose::Pose;
use super::scene::{LightSources, Scene};
use super::view::{Frame, View};

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
    /// Cached backgrounds: of darkness and of each lamp alone at full power, and of one further lighting; without and with
    /// flash.
    backgrounds: Vec<(Lighting, bool, YcbcrImage)>,
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
            noise: Noise::new(seed, sensor::GREY * scene.noise, scene.width as usize),
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

    /// The picture of `pose` with the lamps `lit`, taken with or without the flash.
    ///
    /// The picture depends on the arguments alone; `frame_index` selects the noise.
    #[must_use]
    pub fn draw(&mut self, pose: &Pose, lit: impl Into<Lighting>, flash: bool, frame_index: u64) -> Image {
        self.expose(pose, lit.into(), flash, frame_index);
        self.film.picture()
    }

    /// The same picture as [`Self::draw`] gives, as the bytes of a JPEG file.
    #[must_use]
    pub fn photograph(
        &mut self,
        pose: &Pose,
        lit: impl Into<Lighting>,
        flash: bool,
        frame_index: u64,
    ) -> Vec<u8> {
        self.expose(pose, lit.into(), flash, frame_index);
        jpeg::encode(&self.film, self.scene.jpeg_quality)
    }

    fn expose(&mut self, pose: &Pose, lit: Lighting, flash: bool, frame_index: u64) {
        let lit = lit.within(&self.layout);
        let lighting = LightSources::new(&self.scene, &self.layout, lit, flash, self.view);
        let mut film = std::mem::take(&mut self.film);
        film.clone_from(self.background(&lighting, lit, flash));
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

    fn background(&mut self, sources: &LightSources, lit: Lighting, flash: bool) -> &YcbcrImage {
        let Self { scene, background, tone, blur, backgrounds, .. } = self;
        let known = backgrounds.iter().position(|(of, with_flash, _)| (*of, *with_flash) == (lit, flash));
        let number = known.unwrap_or_else(|| {
            // Levels have too many states to keep.
            backgrounds.retain(|(of, with_flash, _)| of.single().is_some() || *with_flash != flash);
            let (width, height) = (scene.width as usize, scene.height as usize);
            let mut rgb = background.photograph(scene, sources, tone);
            blur.apply(&mut rgb, width, 3);
            backgrounds.push((lit, flash, YcbcrImage::of(&Image { width, height, rgb })));
            backgrounds.len() - 1
        });
        &backgrounds[number].2
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
