//! `tropism timelapse`: a run as one picture and as a film.

mod sink;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use tropism::geometry::Region;
use tropism::photo::Image;
use tropism::task::Task;
use tropism::track::Sample;
use tropism_lab::{Journal, Row, RunConfig, files};
use tropism_report::{Composite, Film, FilmStep, Plants, cropped, scaled};

use self::sink::Sink;
use crate::options::parse_region;
use crate::shell::{Interrupted, Shell};

/// Pictures of a film if the user does not say which.
const PICTURES: usize = 300;

/// Pictures whose colours stand for those of all.
const SAMPLES: usize = 8;

/// Photographs that are decoded at a time, so that a folder of any size needs the same memory.
const BATCH: usize = 16;

/// How many times a part of the photographs is enlarged at most.
const LARGEST: usize = 4;

/// How long the last picture stays, in hundredths of a second.
const LAST: u16 = 200;

/// Make a film of a run's photographs, and all of them in one picture
///
/// The film shows the lit lamp, the targets and the path of the tip, coloured by the lamp that was lit. The picture, the
/// paper's Figure 2, has the lightest value of every pixel: a plant before dark cloth leaves a print of each of its
/// postures. It goes beside the film, as .jpg. Virtual plants are called so in both. A run that is not over, and any folder
/// of photographs, will do.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism timelapse steered --out steered.gif\n  \
    tropism timelapse bean --out bean.mp4 --width 1080 --fps 30 --every 1\n  \
    tropism timelapse my-photos --out figure-2.jpg")]
pub(crate) struct Timelapse {
    /// Run folder, or a folder of photographs
    #[arg(value_name = "RUN")]
    folder: PathBuf,

    /// Film as .gif, or as .mp4 where ffmpeg is installed; .jpg makes the composite picture alone
    #[arg(long, value_name = "FILE")]
    out: PathBuf,

    /// Width in pixels at most; no larger than the photographs, or four times the part of --crop
    #[arg(long, default_value_t = 480, value_name = "N", value_parser = clap::value_parser!(u16).range(16..=8192))]
    width: u16,

    /// Pictures a second
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: u16,

    /// Take each Nth photograph; so many that the film has at most 300 pictures by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: Option<u32>,

    /// Show a part of the photographs: `plant`, where the tip went, with targets and root, or X,Y,W,H in pixels
    #[arg(long, value_name = "plant|X,Y,W,H", value_parser = Crop::parse)]
    crop: Option<Crop>,

    /// Draw nothing into the photographs but that a virtual plant is virtual
    #[arg(long)]
    plain: bool,
}

#[derive(Clone, Copy)]
enum Crop {
    Plant,
    Region(Region),
}

impl Crop {
    fn parse(text: &str) -> Result<Self, String> {
        if text == "plant" { Ok(Self::Plant) } else { parse_region(text).map(Self::Region) }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Outcome {
    film: Option<PathBuf>,
    composite: PathBuf,
    photographs: usize,
    pictures: usize,
    /// Photographs that cannot be read, or are of another size than the first.
    left_out: usize,
    width: usize,
    height: usize,
    is_virtual: Option<bool>,
}

/// Photographs in order, and what is known of them.
struct Source {
    photographs: Vec<PathBuf>,
    film: Film,
    crop: Option<Region>,
    width: usize,
}

/// A photograph at the size of the film, and how wide it was before.
struct Small {
    image: Image,
    photograph_width: usize,
}

impl Source {
    /// A photograph as the film shows it; `None` if it cannot be read, or the part to be shown is not in it.
    fn read(&self, index: usize) -> Option<Small> {
        let photograph = files::read_photo(&self.photographs[index], 0.0).ok()?.decode().ok()?;
        let (photograph, most) = match self.crop {
            Some(region) => (cropped(&photograph, region)?, LARGEST * region.width),
            None => {
                let width = photograph.width;
                (photograph, width)
            }
        };
        let image = scaled(&photograph, self.width.min(most));
        Some(Small { image, photograph_width: photograph.width })
    }

    /// Why none of the `chosen` photographs can be used: what is wrong with the first.
    fn problem(&self, chosen: &[usize]) -> anyhow::Error {
        let (first, count) = (&self.photographs[chosen[0]], chosen.len());
        let decoded = files::read_photo(first, 0.0).map_err(anyhow::Error::from);
        match (decoded.and_then(|photo| Ok(photo.decode()?)), self.crop) {
            (Ok(Image { width, height, .. }), Some(region)) => anyhow!(
                "{}: found {width} x {height} pixels, wanted the region {},{},{},{} of --crop inside",
                first.display(),
                region.x,
                region.y,
                region.width,
                region.height
            ),
            (Ok(_), None) => anyhow!("{}: cannot be read any more", first.display()),
            (Err(error), _) => {
                anyhow!("{}: {error}; none of {count} files is a whole photograph", first.display())
            }
        }
    }

    /// The part that was asked for, if it is in the photographs.
    fn crop(mut self, crop: Option<Crop>, folder: &Path) -> Result<Self> {
        const MARGIN_CM: f64 = 2.0;
        let region = match crop {
            None => return Ok(self),
            Some(Crop::Region(region)) => region,
            Some(Crop::Plant) => self.film.region(MARGIN_CM).with_context(|| {
                format!(
                    "--crop plant: found no calibration in {}, wanted X,Y,W,H in pixels",
                    folder.display()
                )
            })?,
        };
        self.film = self.film.cropped(region);
        self.crop = Some(region);
        Ok(self)
    }
}

impl Timelapse {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let form = self.form()?;
        let mut source = self.source()?.crop(self.crop, &self.folder)?;
        if self.plain {
            source.film = Film { targets: Vec::new(), steps: Vec::new(), ..source.film };
        }
        let every =
            self.every.map_or_else(|| source.photographs.len().div_ceil(PICTURES), |every| every as usize);
        let chosen: Vec<usize> = (0..source.photographs.len()).step_by(every).collect();
        let samples = self.samples(&source, &chosen)?;
        let size = (samples[0].width, samples[0].height);
        let part = self.out.with_extension(format!("part.{form}"));
        let cannot = || format!("{}: cannot write", self.out.display());
        let made = Sink::new(form, &part, &samples, &source.film, self.fps).with_context(cannot).and_then(
            |mut sink| match self.make(shell, &source, &chosen, size, &mut sink) {
                Ok(made) => sink.finish().with_context(cannot).map(|()| made),
                Err(error) => {
                    sink.give_up();
                    Err(error)
                }
            },
        );
        let (composite, pictures) = made.inspect_err(|_| {
            // Nothing half-written stays.
            let _ = std::fs::remove_file(&part);
        })?;
        let film = (form != "jpg").then(|| self.out.clone());
        if film.is_some() {
            std::fs::rename(&part, &self.out).with_context(cannot)?;
        }
        let cover = self.out.with_extension("jpg");
        files::write(&cover, &composite.to_jpeg(90)?)?;
        let outcome = Outcome {
            film,
            composite: cover,
            photographs: source.photographs.len(),
            pictures,
            left_out: chosen.len() - pictures,
            width: size.0,
            height: size.1,
            is_virtual: source.film.plants.map(Plants::is_virtual),
        };
        shell.result(&outcome.text(self.fps), &outcome)
    }

    /// What is made, by the extension of `--out`.
    fn form(&self) -> Result<&'static str> {
        let extension = self.out.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "gif" => Ok("gif"),
            "mp4" => Ok("mp4"),
            "jpg" | "jpeg" => Ok("jpg"),
            _ => bail!("--out {}: wanted .gif, .mp4 or .jpg", self.out.display()),
        }
    }

    /// The photographs of a run in the order of its journal, or those of any folder in the order of their names.
    fn source(&self) -> Result<Source> {
        let width = usize::from(self.width);
        let mut film = Film::default();
        if !self.folder.join("run.toml").exists() {
            let photographs = files::photographs(std::slice::from_ref(&self.folder))?;
            // The photographs of a run by themselves are still those of its plant.
            film.plants = RunConfig::read(&self.folder.join("..")).ok().map(|plan| plan.plants());
            return Ok(Source { photographs, film, crop: None, width });
        }
        let plan = RunConfig::read(&self.folder)?;
        film.plants = Some(plan.plants());
        film.calibration = plan.calibration();
        film.targets = plan.task.targets().to_vec();
        let file = self.folder.join("journal.sqlite");
        if !file.exists() {
            // A plant that was grown: nobody looked at its photographs, but its track is known.
            let photographs = files::photographs(&[self.folder.join("photographs")])?;
            let track = files::read_track(&self.folder.join("track.csv"))?;
            let step = |sample: &Sample| FilmStep {
                time_s: sample.time_s,
                tip: Some(sample.tip),
                light: sample.light,
            };
            film.steps = track.samples.iter().map(step).collect();
            film.layout = track.layout;
            return Ok(Source { photographs, film, crop: None, width });
        }
        let rows = Journal::open_to_read(&file)
            .and_then(|journal| journal.rows())
            .with_context(|| file.display().to_string())?;
        ensure!(!rows.is_empty(), "{}: found no steps, wanted a run that has begun", file.display());
        let photographs = rows.iter().map(|row| self.folder.join("photographs").join(&row.photo)).collect();
        let step = |row: &Row| FilmStep {
            time_s: row.time_s,
            tip: row.seen.observation.as_ref().map(|seen| seen.tip),
            light: row.decided,
        };
        film.steps = rows.iter().map(step).collect();
        Ok(Source { photographs, film, crop: None, width })
    }

    /// Some pictures from all over the film, as it will show them; at least one.
    fn samples(&self, source: &Source, chosen: &[usize]) -> Result<Vec<Image>> {
        let mut samples: Vec<Image> = Vec::new();
        let sample = |index: usize| {
            let Small { image, photograph_width } = source.read(index)?;
            Some(source.film.frame(&image, photograph_width, index))
        };
        for &index in chosen.iter().step_by(chosen.len().div_ceil(SAMPLES)) {
            let Some(sample) = sample(index) else { continue };
            if samples
                .first()
                .is_none_or(|first| (first.width, first.height) == (sample.width, sample.height))
            {
                samples.push(sample);
            }
        }
        if samples.is_empty() {
            // None of a few can be used: perhaps another can.
            samples.extend(chosen.iter().find_map(|&index| sample(index)));
        }
        if samples.is_empty() {
            return Err(source.problem(chosen));
        }
        Ok(samples)
    }

    /// Sends the pictures to `sink` and returns the composite and how many pictures there were.
    fn make(
        &self,
        shell: &Shell,
        source: &Source,
        chosen: &[usize],
        size: (usize, usize),
        sink: &mut Sink,
    ) -> Result<(Image, usize)> {
        let progress = shell.progress("timelapse", chosen.len() as u64);
        let (mut composite, mut pictures, mut wide) = (Composite::default(), 0, 0);
        for batch in chosen.chunks(BATCH) {
            let wants_film = !matches!(sink, Sink::Nowhere);
            let made: Vec<_> = batch
                .par_iter()
                .map(|&index| {
                    let small = source.read(index)?;
                    let drawn = || source.film.frame(&small.image, small.photograph_width, index);
                    let frame = wants_film.then(drawn);
                    Some((index, small, frame))
                })
                .collect();
            for (index, small, frame) in made.into_iter().flatten() {
                if (small.image.width, small.image.height) != size {
                    continue;
                }
                (wide, pictures) = (small.photograph_width, pictures + 1);
                composite.add(&small.image);
                if let Some(frame) = frame {
                    let is_last = Some(&index) == chosen.last();
                    let cannot = || format!("{}: cannot write", self.out.display());
                    sink.add(&frame, if is_last { LAST } else { 100 / self.fps }).with_context(cannot)?;
                }
            }
            progress.add(batch.len() as u64);
            if Shell::is_interrupted() {
                return Err(Interrupted("nothing was written".to_owned()).into());
            }
        }
        let composite = composite.image().context("at least one photograph was read before")?;
        Ok((source.film.cover(composite, wide), pictures))
    }
}

impl Outcome {
    fn text(&self, fps: u16) -> String {
        let left_out = match self.left_out {
            0 => String::new(),
            count => format!("\n{count} photographs were left out: damaged, or of another size"),
        };
        let film = self.film.as_ref().map_or_else(String::new, |film| {
            let seconds = self.pictures as f64 / f64::from(fps);
            format!("\nwrote {}: {} pictures, {seconds:.1} s", film.display(), self.pictures)
        });
        let kind = if self.is_virtual == Some(true) { " of a virtual plant" } else { "" };
        format!(
            "{} photographs{kind}; {} x {} pixels{left_out}{film}\nwrote {}",
            self.photographs,
            self.width,
            self.height,
            self.composite.display()
        )
    }
}
