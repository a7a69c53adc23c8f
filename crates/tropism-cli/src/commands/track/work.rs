//! Photographs on their way into tables: read and judged side by side, taken in in order.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::Result;
use rayon::prelude::*;
use tropism::experiment::files;
use tropism::light::Light;
use tropism::photo::{Image, LazyImage, Photo, PhotoError};
use tropism::vision::pixels::Pixels;
use tropism::vision::{Class, Eye, lit};

use super::drawing::{Drawings, Drawn};
use super::journal::{Journal, Judged, Looked};
use super::plants::Plant;
use super::series::{Series, Shot};
use super::table::Table;
use crate::shell::Progress;

/// Photographs on their way into tables.
pub(super) struct Work<'a> {
    pub(super) series: &'a Series,
    pub(super) plants: &'a [Plant],
    /// Where they are not read from the pictures.
    pub(super) lights: Option<Vec<Option<Light>>>,
    pub(super) eyes: Vec<Eye>,
    pub(super) tables: Vec<Table>,
    pub(super) journal: Journal,
    pub(super) drawings: Drawings,
    /// Those of the photographs, one after the other.
    pub(super) sha256: String,
    pub(super) problems: BTreeMap<String, String>,
}

impl Work<'_> {
    /// Reads and judges photographs side by side, and takes them in in order.
    pub(super) fn batch(&mut self, batch: Range<usize>, progress: &Progress) -> Result<()> {
        let read = |shot: &Shot| {
            let photo = files::read_photo(&shot.path, shot.time_s).map_err(|error| error.to_string());
            let sha256 = photo.as_ref().map_or_else(|_| String::new(), |photo| files::sha256(&photo.bytes));
            (photo, sha256)
        };
        let shots = &self.series.shots;
        let photos: Vec<_> = shots[batch.clone()].par_iter().map(read).collect();
        let mut known = Vec::with_capacity(batch.len());
        for (shot, (_, sha256)) in shots[batch.clone()].iter().zip(&photos) {
            known.push(self.journal.find(&shot.name, sha256)?);
        }
        let eyes = &self.eyes;
        let drawings = &self.drawings;
        let looks: Vec<Look> = batch
            .clone()
            .into_par_iter()
            .zip(photos)
            .zip(known)
            // One by one: a thread that is done takes the next, and none waits long at the end.
            .with_max_len(1)
            .map(|((index, (photo, sha256)), known)| {
                let name = &shots[index].name;
                look(eyes, name, known, photo, sha256, drawings.needs(index, name))
            })
            .collect::<Result<_>>()?;
        let new: Vec<&str> = looks.iter().filter_map(|look| look.line.as_deref()).collect();
        if new.len() < looks.len() {
            progress.skip((looks.len() - new.len()) as u64);
        }
        for (index, look) in batch.zip(&looks) {
            self.settle(index, look)?;
        }
        // After the drawings, so that a photograph that is written down is drawn, too.
        self.journal.add(&new)?;
        progress.add(new.len() as u64);
        let counts = &self.tables[0].counts;
        progress.say(format!("{} measured, {} held", counts.measured, counts.held));
        Ok(())
    }

    /// Takes in the next photograph.
    fn settle(&mut self, index: usize, look: &Look) -> Result<()> {
        let judged = &look.judged;
        let shot = &self.series.shots[index];
        let light = self.lights.as_ref().map_or(judged.light, |lights| lights[index]);
        let is_repeated = !judged.sha256.is_empty() && self.sha256.ends_with(&judged.sha256);
        let problem = if is_repeated {
            Some("the same bytes as the photograph before".to_owned())
        } else {
            judged.problem.clone()
        };
        self.sha256 += &judged.sha256;
        self.problems.extend(problem.map(|problem| (shot.name.clone(), problem)));
        let mut seen = Vec::with_capacity(self.plants.len());
        for ((eye, table), looked) in self.eyes.iter_mut().zip(&mut self.tables).zip(&judged.plants) {
            let found = if is_repeated { Err(Class::Repeated) } else { looked.found() };
            let one = eye.settle_at(found, shot.time_s);
            table.add(shot, looked.sighting.as_ref(), one.clone(), light);
            seen.push(one);
        }
        let Some(image) = &look.image else { return Ok(()) };
        let drawn: Vec<Drawn<'_>> = self
            .plants
            .iter()
            .zip(&judged.plants)
            .zip(&seen)
            .map(|((plant, looked), seen)| Drawn { plant, sighting: looked.sighting.as_ref(), seen })
            .collect();
        self.drawings.add(index, &shot.name, image, &drawn, light)
    }
}

/// A photograph by itself, and its picture where it is to be drawn.
struct Look {
    judged: Judged,
    /// Its line in the journal, where it is not there yet.
    line: Option<String>,
    image: Option<Arc<Image>>,
}

/// What a photograph shows by itself: as it is known, or judged now.
fn look(
    eyes: &[Eye],
    name: &str,
    known: Option<Judged>,
    photo: Result<Photo, String>,
    sha256: String,
    is_drawn: bool,
) -> Result<Look> {
    let is_new = known.is_none();
    let open = || photo.map(|photo| photo.open());
    let (judged, picture) = match known {
        Some(judged) => (judged, if is_drawn { open().ok().and_then(Result::ok) } else { None }),
        None => judge(eyes, name, open(), sha256),
    };
    let line = if is_new { Some(judged.line()?) } else { None };
    let image = picture.filter(|_| is_drawn).map(|picture| Arc::new(picture.into_image()));
    Ok(Look { judged, line, image })
}

fn judge(
    eyes: &[Eye],
    name: &str,
    picture: Result<Result<LazyImage, PhotoError>, String>,
    sha256: String,
) -> (Judged, Option<LazyImage>) {
    // A file that cannot be read is a damaged photograph, not the end of the batch.
    let looked = |eye: &Eye| match &picture {
        Ok(picture) => Looked::new(eye.judge(picture.as_ref())),
        Err(_) => Looked::new(Err(Class::Corrupt)),
    };
    let plants: Vec<Looked> = eyes.iter().map(looked).collect();
    let problem = match &picture {
        Err(problem) => Some(problem.clone()),
        Ok(Err(error)) => Some(error.to_string()),
        Ok(Ok(picture)) => {
            let (width, height) = picture.size();
            eyes[0].calibration().fits(width, height).err().map(|error| error.to_string())
        }
    };
    let picture = picture.ok().and_then(Result::ok);
    let light = picture.as_ref().and_then(|picture| lit(picture, None));
    (Judged { frame: name.to_owned(), sha256, light, problem, plants }, picture)
}
