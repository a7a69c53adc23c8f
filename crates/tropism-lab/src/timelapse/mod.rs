//! The workflow `timelapse`: the photographs of a run as a film, and laid over each other as one picture.
//!
//! In comes a run folder, or any folder of photographs. Out come a film that shows the lit lamp, the targets and the path of
//! the tip, and the composite of Figure 2: the lightest value of every pixel.

mod sink;
mod source;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::geometry::Region;
use tropism::parallel;
use tropism::photo::Image;
use tropism_report::{Composite, Film, Plants};

use crate::error::Error;
use crate::files;
use crate::monitor::Monitor;
use crate::workflow::Workflow;
use sink::{Format, Sink};
use source::{Shrunk, Source};

/// Photographs that are decoded at a time, so that the memory does not grow with the folder; chosen by hand.
const BATCH: usize = 16;

/// Pictures whose colours stand for those of the whole film; chosen by hand.
const COLOUR_SAMPLES: usize = 8;

/// How long the last picture stays, in hundredths of a second.
const LAST_DELAY: u16 = 200;

/// Quality of the composite's JPEG, 1 to 100.
const JPEG_QUALITY: u8 = 90;

/// The film to make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimelapsePlan {
    /// Run folder, or a folder of photographs.
    pub folder: PathBuf,
    /// Film, `.gif` or `.mp4`; with `.jpg` the composite alone is made.
    pub out: PathBuf,
    /// Width in pixels, 16 to 8192; no larger than the photographs, or four times the part of [`crop`](Self::crop).
    #[serde(default = "default_width")]
    pub width: u16,
    /// Pictures a second, 1 to 50.
    #[serde(default = "default_fps")]
    pub fps: u16,
    /// Takes each Nth photograph; if it is left out, as many as give 300 pictures at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<u32>,
    /// The part of the photographs that is shown; all of it if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// Whether nothing is drawn into the photographs but the label of a virtual plant.
    #[serde(default)]
    pub plain: bool,
    /// Whether a film or a picture that is there is replaced.
    #[serde(default)]
    pub replace: bool,
}

const fn default_width() -> u16 {
    480
}

const fn default_fps() -> u16 {
    20
}

/// A part of the photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Crop {
    /// Where the tip went, with the targets and the root.
    Plant,
    /// A region in pixels.
    Region(Region),
}

/// What was made.
#[derive(Clone, Debug, Serialize)]
pub struct TimelapseResults {
    /// The film; `None` if only the composite was made.
    pub film: Option<PathBuf>,
    /// The composite.
    pub composite: PathBuf,
    /// Photographs of the run.
    pub photographs: usize,
    /// Pictures of the film.
    pub pictures: usize,
    /// Photographs that cannot be read, or are of another size than the first.
    pub left_out: usize,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether the plant is virtual; `None` if it is not known.
    pub is_virtual: Option<bool>,
}

impl Workflow for TimelapsePlan {
    type Results = TimelapseResults;
    const SCHEMA: &'static str = "tropism.timelapse/1";

    fn check(&self) -> Result<(), Error> {
        Format::of(&self.out)?;
        for (key, value, range) in [("width", self.width, 16..=8192), ("fps", self.fps, 1..=50)] {
            if !range.contains(&value) {
                let (least, most) = range.into_inner();
                return Err(Error::Plan(format!("`{key}` {value}: wanted {least} to {most}")));
            }
        }
        if self.every == Some(0) {
            return Err(Error::Plan("`every` 0: wanted 1 or more".to_owned()));
        }
        files::check_outputs_with(&self.outputs()?, || self.inputs())?;
        [&self.out, &self.cover()].into_iter().try_for_each(|file| files::check_free(file, self.replace))
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<TimelapseResults, Error> {
        let format = Format::of(&self.out)?;
        let mut source =
            Source::open(&self.folder, usize::from(self.width))?.cropped(self.crop, &self.folder)?;
        if self.plain {
            source.film = Film { targets: Vec::new(), steps: Vec::new(), ..source.film };
        }
        let chosen = source.choose(self.every);
        let samples = source.samples(&chosen, COLOUR_SAMPLES)?;
        let part = self.part(format);
        let mut sink =
            Sink::create(format, &part, &samples, &source.film, self.fps).map_err(self.cannot_write())?;
        let scene = Scene { source, chosen, size: (samples[0].width, samples[0].height) };
        let made = match self.make(&scene, &mut sink, monitor) {
            Ok(made) => sink.finish().map_err(self.cannot_write()).map(|()| made),
            Err(error) => {
                sink.abandon();
                Err(error)
            }
        };
        let (composite, pictures) = made.inspect_err(|_| {
            // A film that is not whole is of no use.
            let _ = std::fs::remove_file(&part);
        })?;
        let film = (format != Format::Composite).then(|| self.out.clone());
        if film.is_some() {
            std::fs::rename(&part, &self.out).map_err(self.cannot_write())?;
        }
        let cover = self.cover();
        let jpeg = composite.to_jpeg(JPEG_QUALITY).map_err(Error::at(cover.display()))?;
        files::write(&cover, &jpeg)?;
        Ok(TimelapseResults {
            film,
            composite: cover,
            photographs: scene.source.photographs.len(),
            pictures,
            left_out: scene.chosen.len() - pictures,
            width: scene.size.0,
            height: scene.size.1,
            is_virtual: scene.source.film.plants.map(Plants::is_virtual),
        })
    }
}

/// The photographs of a film, the indices of those that it shows, and its size.
struct Scene {
    source: Source,
    chosen: Vec<usize>,
    size: (usize, usize),
}

impl TimelapsePlan {
    /// The name under which a film is written before it takes its place.
    fn part(&self, format: Format) -> PathBuf {
        self.out.with_extension(format!("part.{}", format.extension()))
    }

    /// The composite.
    fn cover(&self) -> PathBuf {
        self.out.with_extension("jpg")
    }

    /// The files that may be written: film and composite.
    fn outputs(&self) -> Result<[PathBuf; 3], Error> {
        Ok([self.out.clone(), self.part(Format::of(&self.out)?), self.cover()])
    }

    /// The files that may be read: of a run all but former films and composites, else the photographs.
    fn inputs(&self) -> Vec<PathBuf> {
        if !self.folder.join("run.toml").exists() {
            return files::photographs(std::slice::from_ref(&self.folder)).unwrap_or_default();
        }
        let is_former = |file: &PathBuf| file.parent() == Some(&self.folder) && Format::of(file).is_ok();
        files::files_below(&self.folder).into_iter().filter(|file| !is_former(file)).collect()
    }

    fn cannot_write<E: Into<Box<dyn std::error::Error + Send + Sync>>>(
        &self,
    ) -> impl FnOnce(E) -> Error + use<E> {
        Error::at(format!("{}: cannot write", self.out.display()))
    }

    /// Sends the pictures to `sink`, and returns the composite and the number of pictures.
    fn make(&self, scene: &Scene, sink: &mut Sink, monitor: &dyn Monitor) -> Result<(Image, usize), Error> {
        let Scene { source, chosen, size } = scene;
        monitor.stage("timelapse", chosen.len() as u64);
        let (mut composite, mut pictures, mut photograph_width) = (Composite::default(), 0, 0);
        for batch in chosen.chunks(BATCH) {
            let has_film = !matches!(sink, Sink::None);
            let draw = |index: usize| {
                let shrunk = source.read(index)?;
                let frame =
                    has_film.then(|| source.film.frame(&shrunk.image, shrunk.photograph_width, index));
                Some((index, shrunk, frame))
            };
            let drawn: Vec<_> = parallel::map(batch.len(), |number| draw(batch[number]));
            for (index, Shrunk { image, photograph_width: width }, frame) in drawn.into_iter().flatten() {
                if (image.width, image.height) != *size {
                    continue;
                }
                (photograph_width, pictures) = (width, pictures + 1);
                composite.add(&image);
                if let Some(frame) = frame {
                    let is_last = Some(&index) == chosen.last();
                    let delay = if is_last { LAST_DELAY } else { 100 / self.fps };
                    sink.add(&frame, delay).map_err(self.cannot_write())?;
                }
            }
            monitor.advance(batch.len() as u64);
            if !monitor.may_go_on() {
                return Err(Error::Cancelled("nothing was written".to_owned()));
            }
        }
        let composite = composite.image().ok_or_else(|| {
            Error::Failed(format!("{}: the photograph is no longer there", self.folder.display()))
        })?;
        Ok((source.film.cover(composite, photograph_width), pictures))
    }
}
