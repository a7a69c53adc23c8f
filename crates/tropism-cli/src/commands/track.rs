//! `tropism track`: photographs into tracks.

mod drawing;
mod guide;
mod journal;
mod plants;
mod series;
mod table;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::experiment::files;
use tropism::geometry::Region;
use tropism::light::{self, Light};
use tropism::photo::{Image, Photo, PhotoError, Picture};
use tropism::vision::pixels::Pixels;
use tropism::vision::{Calibration, Class, Eye, Mode, VisionConfig, lit};

use self::drawing::{Drawings, Drawn};
use self::journal::{Journal, Judged, Looked};
use self::plants::{PAPER_WIDTH_CM, Plant, Scale};
use self::series::{Series, Shot, TimeFrom};
use self::table::{Counts, Table, words};
use super::run::RunPlan;
use crate::options::{parse_minutes, parse_pair, parse_region, parse_scale};
use crate::shell::{Interrupted, Progress, Shell};

/// Find the tip and the stem in photographs: ours, or anybody's folder of them
///
/// Photographs are taken in the order of their times, or of the numbers in their names. One in which no plant is seen
/// holds the last sighting and says so (`quality` is `held`, `class` tells why); a bad file never ends the batch.
///
/// Beside track.csv stand track.json (calibration, settings, counts, what was wrong with which file) and
/// track.frames.jsonl (what each photograph shows by itself, with the whole midline), by which --resume goes on.
///
/// Without --calibration or --scale, centimetres assume the paper's camera, whose picture is 74 cm wide at the plant.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism track tent/1/photographs --calibration tent/1/calibration.toml --out track.csv\n  \
    tropism track my-photos --guide guide.html\n  \
    tropism track my-photos --roi 250,150,200,185 --scale 11 --base 364,336 --out track.csv --overlay look\n  \
    tropism track two-plants --roi 50,80,200,300 --roi 300,80,200,300 --scale 30,420,195,421=15 --out track.csv")]
pub(crate) struct Track {
    /// Photographs (JPEG or PNG), or folders of them
    #[arg(required = true, value_name = "PHOTOS")]
    photographs: Vec<PathBuf>,

    /// Where the track goes; with several plants track-1.csv, track-2.csv and so on
    #[arg(
        long,
        value_name = "track.csv",
        required_unless_present = "guide",
        default_value = "track.csv",
        hide_default_value = true
    )]
    out: PathBuf,

    /// Begin here: a page to open in a browser, on which root, scale and region are clicked and the command copied. With
    /// --roi, what is found there is drawn in
    #[arg(long, value_name = "PAGE.html", conflicts_with_all = ["out", "resume", "overlay", "sheet"])]
    guide: Option<PathBuf>,

    /// Where the root is and how many pixels make a cm (base, px_per_cm, width, height)
    #[arg(long, value_name = "FILE", conflicts_with = "scale")]
    calibration: Option<PathBuf>,

    /// Pixels per cm in the plane of the stem, or two pixels and the cm between them: a ruler's ends, the pot's rim
    #[arg(long, value_name = "PX_PER_CM|X,Y,X,Y=CM", value_parser = parse_scale, allow_hyphen_values = true)]
    scale: Option<f64>,

    /// Pixel where the stem leaves the soil; the middle of the region's lower edge by default. Once a plant
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Vec<Pair>,

    /// Region of interest: the plant without pot and lamps; the whole picture by default. Once a plant
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    roi: Vec<Region>,

    /// Several plants by name: a TOML file with [[plant]] tables of name, region and base
    #[arg(long, value_name = "PLANTS.toml", conflicts_with_all = ["roi", "base"])]
    plants: Option<PathBuf>,

    /// Which lamp is lit: read from the pictures, none (no lamps in view), or from a CSV with the columns frame and light
    #[arg(long, value_name = "auto|none|FILE.csv", default_value = "auto")]
    light: PathBuf,

    /// What tells when a photograph was taken
    #[arg(long, value_enum, default_value = "auto")]
    time: TimeFrom,

    /// Time from one photograph to the next, a step; by default the usual one, or five minutes where no times are known
    #[arg(long, value_name = "TIME", value_parser = parse_minutes)]
    period: Option<f64>,

    /// The robust method, or the paper's to the letter
    #[arg(long, value_name = "robust|paper", default_value = "robust", value_parser = parse_mode)]
    mode: Mode,

    /// Folder for a copy of each photograph with what was seen drawn in
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,

    /// Up to 24 photographs from first to last on one sheet, with what was seen drawn in
    #[arg(long, value_name = "SHEET.jpg")]
    sheet: Option<PathBuf>,

    /// Go on where the same command stopped, or take new photographs in
    #[arg(long)]
    resume: bool,

    /// Replace results that are there already
    #[arg(long, conflicts_with = "resume")]
    force: bool,
}

type Pair = [f64; 2];

fn parse_mode(text: &str) -> Result<Mode, String> {
    match text {
        "robust" => Ok(Mode::Robust),
        "paper" => Ok(Mode::Paper),
        _ => Err("wanted robust or paper".to_owned()),
    }
}

/// Photographs that are decoded at a time, so that a folder of any size needs the same memory.
const BATCH: usize = 32;

/// Bad files that are named on the terminal; all are in the JSON file.
const NAMED: usize = 5;

/// All that decides what is made of the photographs.
#[derive(Serialize)]
struct Settings<'a> {
    version: &'static str,
    vision: VisionConfig,
    plants: &'a [Plant],
    time: TimeFrom,
    period_min: Option<f64>,
    light: String,
}

/// What stands in the JSON file beside a track, and with `--json` on stdout.
#[derive(Serialize)]
struct Outcome<'a> {
    schema: &'static str,
    track: PathBuf,
    plant: Option<&'a str>,
    is_virtual: bool,
    #[serde(flatten)]
    counts: &'a Counts,
    time_from: TimeFrom,
    period_min: f64,
    missing_steps: u32,
    calibration: Calibration,
    calibration_is_assumed: bool,
    /// The SHA-256 of the photographs' own, one after the other.
    photographs_sha256: String,
    problems: &'a BTreeMap<String, String>,
    settings: &'a Settings<'a>,
    settings_sha256: &'a str,
}

/// Whether the JSON file beside a track says that the plant is virtual.
pub(crate) fn is_virtual(track: &Path) -> bool {
    #[derive(Deserialize)]
    struct Sidecar {
        is_virtual: bool,
    }
    let text = files::read_text(&track.with_extension("json"));
    text.is_ok_and(|text| serde_json::from_str::<Sidecar>(&text).is_ok_and(|sidecar| sidecar.is_virtual))
}

/// A photograph by itself, and its picture where it is to be drawn.
struct Look {
    judged: Judged,
    is_new: bool,
    image: Option<Arc<Image>>,
}

impl Track {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let paths = files::photographs(&self.photographs)?;
        let series = Series::read(&paths, self.time, self.period)?;
        if let Some(page) = &self.guide {
            return self.guide(page, &series, shell);
        }
        let plants = self.plants(&series.shots)?;
        let lights = self.lights(&series.shots)?;
        let settings = self.settings(&plants);
        let settings_sha256 = files::sha256(&serde_json::to_vec(&settings)?);
        self.check_is_free(&plants)?;
        if self.assumes_scale() {
            let px_per_cm = plants[0].calibration.px_per_cm;
            shell.note(&format!(
                "no --calibration or --scale: assuming a picture {PAPER_WIDTH_CM} cm wide at the plant \
                 ({px_per_cm:.2} px/cm)"
            ));
        }
        if let Some(folder) = &self.overlay {
            files::make_folder(folder)?;
        }
        let journal = self.out.with_extension("frames.jsonl");
        let mut work = Work {
            series: &series,
            plants: &plants,
            lights,
            eyes: plants
                .iter()
                .map(|plant| Eye::new(plant.calibration, plant.vision(self.mode)))
                .collect::<Result<_, _>>()?,
            tables: plants.iter().map(|plant| Table::new(plant.calibration)).collect(),
            journal: Journal::open(&journal, &settings_sha256, self.resume)?,
            drawings: Drawings::new(
                self.overlay.as_deref(),
                self.sheet.as_deref(),
                &plants,
                series.shots.len(),
            ),
            sha256: String::new(),
            problems: BTreeMap::new(),
        };
        // What stands still in the first picture tells how far the camera has moved in later ones.
        let first = series.shots.iter().find_map(|shot| files::read_photo(&shot.path, 0.0).ok()?.open().ok());
        for eye in &mut work.eyes {
            first.iter().for_each(|picture| eye.refer(picture));
        }
        let progress = shell.progress("track", series.shots.len() as u64);
        for start in (0..series.shots.len()).step_by(BATCH) {
            work.batch(start..(start + BATCH).min(series.shots.len()), &progress)?;
            if Shell::is_interrupted() {
                return Err(Interrupted::resumable(&journal));
            }
        }
        drop(progress);
        work.drawings.finish()?;
        self.finish(&work, &settings, &settings_sha256, shell)
    }

    /// Writes the page, with what is found where a region is known.
    fn guide(&self, page: &Path, series: &Series, shell: &Shell) -> Result<()> {
        #[derive(Serialize)]
        struct Outcome<'a> {
            guide: &'a Path,
            shown: Vec<String>,
        }
        let is_placed = !self.roi.is_empty() || self.plants.is_some();
        let plants = if is_placed { self.plants(&series.shots)? } else { Vec::new() };
        let draw = |image: Image| {
            let look = |plant: &Plant| {
                let mut eye = Eye::new(plant.calibration, plant.vision(self.mode)).ok()?;
                let found = eye.judge(Ok(&image));
                Some((found.clone().ok(), eye.settle(found)))
            };
            let seen: Vec<_> = plants.iter().filter_map(look).collect();
            let drawn: Vec<Drawn<'_>> = plants
                .iter()
                .zip(&seen)
                .map(|(plant, (sighting, seen))| Drawn { plant, sighting: sighting.as_ref(), seen })
                .collect();
            drawing::drawn(&image, &drawn, lit(&image, None))
        };
        let shown = guide::write(page, &self.photographs, &series.shots, &plants, self.scale, draw)?;
        let text = format!(
            "{} photographs, {}\nwrote {}: open it in a browser, click, and copy the command",
            series.shots.len(),
            series.words(),
            page.display()
        );
        shell.result(&text, &Outcome { guide: page, shown })
    }

    /// The plants that were asked for, with their calibrations.
    fn plants(&self, shots: &[Shot]) -> Result<Vec<Plant>> {
        let entries = match &self.plants {
            Some(path) => plants::read(path)?,
            None => plants::of_options(&self.roi, &self.base)?,
        };
        let scale = match &self.calibration {
            None => Scale::PerCm(self.scale),
            Some(path) => {
                let calibration: Calibration = files::read_toml(path)?;
                calibration.check().with_context(|| path.display().to_string())?;
                Scale::Known(calibration)
            }
        };
        plants::place(entries, &scale, shots)
    }

    const fn assumes_scale(&self) -> bool {
        self.calibration.is_none() && self.scale.is_none()
    }

    fn settings<'a>(&self, plants: &'a [Plant]) -> Settings<'a> {
        Settings {
            version: env!("CARGO_PKG_VERSION"),
            vision: VisionConfig { mode: self.mode, ..VisionConfig::default() },
            plants,
            time: self.time,
            period_min: self.period,
            light: self.light.display().to_string(),
        }
    }

    /// The track of a plant: `track.csv`, or `track-NAME.csv` where there are several.
    fn out(&self, plant: &Plant) -> PathBuf {
        let Some(name) = &plant.name else { return self.out.clone() };
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let file = format!("{stem}-{name}");
        match self.out.extension() {
            Some(extension) => self.out.with_file_name(format!("{file}.{}", extension.to_string_lossy())),
            None => self.out.with_file_name(file),
        }
    }

    /// Checks that no result of another command is in the way.
    fn check_is_free(&self, plants: &[Plant]) -> Result<()> {
        ensure!(
            self.out.extension().is_none_or(|extension| extension != "json" && extension != "jsonl"),
            "--out {}: found the name of the file beside the track, wanted one that ends in .csv",
            self.out.display()
        );
        if self.resume || self.force {
            return Ok(());
        }
        let tracks = plants.iter().map(|plant| self.out(plant));
        let beside = tracks.flat_map(|track| [track.with_extension("json"), track]);
        let overlays = self.overlay.iter().filter(|folder| files::photographs(&[(*folder).clone()]).is_ok());
        let all = beside.chain([self.out.with_extension("frames.jsonl")]).chain(self.sheet.clone());
        if let Some(taken) = all.filter(|path| path.exists()).chain(overlays.cloned()).next() {
            bail!(
                "{}: found results here already, wanted a new name, --resume to go on with them or --force to replace \
                 them",
                taken.display()
            );
        }
        Ok(())
    }

    /// The lights of a file, one a photograph; `None` if they are to be read from the pictures.
    fn lights(&self, shots: &[Shot]) -> Result<Option<Vec<Option<Light>>>> {
        if self.light == Path::new("auto") {
            return Ok(None);
        }
        if self.light == Path::new("none") {
            return Ok(Some(vec![None; shots.len()]));
        }
        let file = self.light.display();
        let text = files::read_text(&self.light)?;
        let mut lines = text.lines();
        let header = lines.next().unwrap_or_default().trim();
        ensure!(header == "frame,light", "{file}: found the header {header:?}, wanted \"frame,light\"");
        let mut named = BTreeMap::new();
        for (number, line) in lines.enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let wanted = || {
                format!("{file}, line {}: found {line:?}, wanted a frame and left, right or dark", number + 2)
            };
            let (frame, word) = line.split_once(',').with_context(wanted)?;
            named.insert(frame.trim(), light::parse(word.trim()).ok().with_context(wanted)?);
        }
        let of = |shot: &Shot| {
            let name = series::file_name(&shot.path);
            let stem = shot.path.file_stem().unwrap_or_default().to_string_lossy();
            let light =
                [shot.name.as_str(), &name, stem.as_ref()].into_iter().find_map(|name| named.get(name));
            light.copied().with_context(|| format!("{file}: found no row for frame {name}, wanted one"))
        };
        Ok(Some(shots.iter().map(of).collect::<Result<_>>()?))
    }

    /// Writes the tracks and what stands beside them.
    fn finish(
        &self,
        work: &Work<'_>,
        settings: &Settings<'_>,
        settings_sha256: &str,
        shell: &Shell,
    ) -> Result<()> {
        let (series, problems) = (work.series, &work.problems);
        let is_virtual = are_virtual(&series.shots);
        let photographs_sha256 = files::sha256(work.sha256.as_bytes());
        let mut outcomes = Vec::new();
        let mut unseen = Vec::new();
        for (plant, table) in work.plants.iter().zip(&work.tables) {
            let outcome = Outcome {
                schema: "tropism.track/1",
                track: self.out(plant),
                plant: plant.name.as_deref(),
                is_virtual,
                counts: &table.counts,
                time_from: series.time_from,
                period_min: series.period_min,
                missing_steps: series.missing(),
                calibration: plant.calibration,
                calibration_is_assumed: self.assumes_scale(),
                photographs_sha256: photographs_sha256.clone(),
                problems,
                settings,
                settings_sha256,
            };
            let Some(track) = table.track() else {
                let which = plant.name.as_ref().map_or_else(String::new, |name| format!("plant {name}: "));
                unseen.push(format!(
                    "{which}found no plant in any of {} photographs ({}), wanted one in the region of interest, with its \
                     foot near --base",
                    table.counts.frames,
                    words(&table.counts.classes)
                ));
                continue;
            };
            files::write_track(&outcome.track, &track)?;
            let json = serde_json::to_string_pretty(&outcome)? + "\n";
            files::write(&outcome.track.with_extension("json"), json.as_bytes())?;
            outcomes.push(outcome);
        }
        if outcomes.is_empty() {
            work.journal.remove()?;
        }
        if let [first, ..] = outcomes.as_slice() {
            let text = self.text(series, problems, &outcomes, first.counts);
            match outcomes.as_slice() {
                [only] => shell.result(&text, only)?,
                several => shell.result(&text, &several)?,
            }
        }
        ensure!(unseen.is_empty(), "{}", unseen.join("; "));
        Ok(())
    }

    fn text(
        &self,
        series: &Series,
        problems: &BTreeMap<String, String>,
        outcomes: &[Outcome<'_>],
        first: &Counts,
    ) -> String {
        let kind = if outcomes[0].is_virtual { " of a virtual plant" } else { "" };
        let mut lines = vec![format!("{} photographs{kind}, {}", first.frames, series.words())];
        lines.push(format!("lamp lit: {}", words(&first.lights)));
        for (name, problem) in problems.iter().take(NAMED) {
            lines.push(format!("{name}: {problem}"));
        }
        if problems.len() > NAMED {
            lines.push(format!("and {} more bad files", problems.len() - NAMED));
        }
        for outcome in outcomes {
            let which = outcome.plant.map_or_else(String::new, |name| format!("plant {name}: "));
            let Counts { measured, held, before, classes, longest_gap, longest_gap_min, .. } = outcome.counts;
            lines.push(format!(
                "{which}{measured} measured, {held} held, {before} before the first sighting ({}); longest gap \
                 {longest_gap} ({longest_gap_min:.0} min)",
                words(classes),
            ));
            lines.push(format!("wrote {}", outcome.track.display()));
        }
        if let Some(place) = self.overlay.as_ref().or(self.sheet.as_ref()) {
            lines.push(format!("look at {}: is the cross on the tip?", place.display()));
        }
        let tracks: Vec<String> =
            outcomes.iter().map(|outcome| outcome.track.display().to_string()).collect();
        lines.push(format!("next: tropism fit {} --out model.json", tracks.join(" ")));
        lines.join("\n")
    }
}

/// Whether photographs lie in a run folder that says that its plant is virtual.
fn are_virtual(shots: &[Shot]) -> bool {
    let mut folders: Vec<&Path> = shots.iter().filter_map(|shot| shot.path.parent()).collect();
    folders.dedup();
    folders
        .iter()
        .flat_map(|folder| [Some(*folder), folder.parent()])
        .flatten()
        .any(|folder| RunPlan::read(folder).is_ok_and(|run| run.is_virtual))
}

/// Photographs on their way into tables.
struct Work<'a> {
    series: &'a Series,
    plants: &'a [Plant],
    /// Where they are not read from the pictures.
    lights: Option<Vec<Option<Light>>>,
    eyes: Vec<Eye>,
    tables: Vec<Table>,
    journal: Journal,
    drawings: Drawings,
    /// Those of the photographs, one after the other.
    sha256: String,
    problems: BTreeMap<String, String>,
}

impl Work<'_> {
    /// Reads and judges photographs side by side, and takes them in in order.
    fn batch(&mut self, batch: Range<usize>, progress: &Progress) -> Result<()> {
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
            .map(|((index, (photo, sha256)), known)| {
                let name = &shots[index].name;
                look(eyes, name, known, photo, sha256, drawings.needs(index, name))
            })
            .collect();
        let new: Vec<Judged> =
            looks.iter().filter(|look| look.is_new).map(|look| look.judged.clone()).collect();
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

/// What a photograph shows by itself: as it is known, or judged now.
fn look(
    eyes: &[Eye],
    name: &str,
    known: Option<Judged>,
    photo: Result<Photo, String>,
    sha256: String,
    is_drawn: bool,
) -> Look {
    let is_new = known.is_none();
    let open = || photo.map(|photo| photo.open());
    let (judged, picture) = match known {
        Some(judged) => (judged, if is_drawn { open().ok().and_then(Result::ok) } else { None }),
        None => judge(eyes, name, open(), sha256),
    };
    Look { judged, is_new, image: picture.filter(|_| is_drawn).map(|picture| Arc::new(picture.into_image())) }
}

fn judge(
    eyes: &[Eye],
    name: &str,
    picture: Result<Result<Picture, PhotoError>, String>,
    sha256: String,
) -> (Judged, Option<Picture>) {
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
