//! Photographs that are tracked in the page: `tropism track` of one plant whose photographs come at even times, to the bit.

use serde_json::{Value, json};
use tropism::geometry::{Pixel, Region};
use tropism::photo::{Photo, natural_order};
use tropism::track::{Column, Sample, Track};
use tropism::vision::raster::source::PixelSource;
use tropism::vision::{Calibration, Detection, Frame, FrameStatus, TipTracker, VisionConfig, lamp_state};
use tropism_bean::view;

use crate::SessionError;

/// A series that is being tracked.
pub(crate) struct Series {
    tracker: TipTracker,
    period_min: f64,
    step: u32,
    /// The last photograph, to know a repeated one.
    last: Vec<u8>,
    samples: Vec<Sample>,
    /// Name, class and confidence of each sample's photograph.
    columns: [Vec<String>; 3],
}

/// Places of the names in their natural order: 9.jpg before 10.jpg.
pub(crate) fn order(names: &[String]) -> Value {
    let mut places: Vec<usize> = (0..names.len()).collect();
    places.sort_by_key(|&place| natural_order(&names[place]));
    json!(places)
}

/// Columns and rows of a photograph.
pub(crate) fn size(bytes: &[u8]) -> Result<Value, SessionError> {
    let (width, height) = photo("", bytes, 0.0).open()?.size();
    Ok(json!({ "width": width, "height": height }))
}

fn photo(name: &str, bytes: &[u8], time_s: f64) -> Photo {
    Photo { name: name.to_owned(), bytes: bytes.to_vec(), time_s }
}

impl Series {
    /// A series of which `first` are the first photographs: the reference for the shift of the camera. Without a scale it is
    /// that of the paper's camera; without a root, the middle of the lower edge of the region.
    pub(crate) fn begin(
        px_per_cm: Option<f64>,
        base: Option<Pixel>,
        region: Option<Region>,
        period_min: f64,
        first: &[&[u8]],
    ) -> Result<Self, SessionError> {
        if !(period_min.is_finite() && period_min > 0.0) {
            return Err(SessionError::Refused(format!(
                "found {period_min} minutes between photographs, wanted more than 0"
            )));
        }
        let pictures: Vec<_> = first.iter().filter_map(|bytes| photo("", bytes, 0.0).open().ok()).collect();
        let none = || SessionError::Refused("found no whole photograph among the first ones".to_owned());
        let (width, height) = pictures.first().ok_or_else(none)?.size();
        let own = region.unwrap_or(Region { x: 0, y: 0, width, height });
        let foot = || {
            let (right, bottom) = (own.x + own.width, own.y + own.height);
            Pixel::new((own.x as f64 + right as f64 - 1.0) / 2.0, bottom as f64 - 1.0)
        };
        let scale = px_per_cm.unwrap_or(width as f64 / view::Frame::WIDTH_CM);
        let calibration = Calibration::from_scale(base.unwrap_or_else(foot), scale, width, height);
        let config = VisionConfig { crop: region, ..VisionConfig::default() };
        let mut tracker = TipTracker::new(calibration, config)?.with_period(period_min);
        pictures.iter().for_each(|picture| tracker.set_reference(picture));
        Ok(Self {
            tracker,
            period_min,
            step: 0,
            last: Vec::new(),
            samples: Vec::new(),
            columns: Default::default(),
        })
    }

    /// Tracks the plant in the next photograph.
    pub(crate) fn next(&mut self, name: &str, bytes: &[u8]) -> Value {
        let time_s = 60.0 * self.period_min * f64::from(self.step);
        let frame = Frame::new(photo(name, bytes, time_s));
        let is_repeated = !bytes.is_empty() && self.last == bytes;
        self.last = bytes.to_vec();
        // Rounded as in the journal of `tropism track`.
        let detected = match is_repeated {
            true => Err(FrameStatus::Repeated),
            false => self.tracker.detect(frame.picture()).map(Detection::rounded),
        };
        let stem = detected.as_ref().ok().and_then(|detection| detection.stem.clone());
        let seen = self.tracker.update(detected, time_s);
        let light = frame.picture().ok().and_then(|picture| lamp_state(picture, None));
        let answer = json!({
            "name": name,
            "class": seen.status.to_string(),
            "is_measured": seen.is_measured(),
            "tip_px": seen.tip_px,
            "tip": seen.observation.as_ref().map(|seen| seen.tip),
            "stem_px": stem.filter(|_| self.tracker.has_measured_stem()),
            "light": light.map(|light| light.to_string()),
            "confidence": seen.confidence,
        });
        if let Some(observation) = seen.observation {
            let sample = Sample::of(observation, self.step, time_s, light);
            self.samples.push(sample);
            let cells = [name.to_owned(), seen.status.to_string(), format!("{:.3}", seen.confidence)];
            self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell));
        }
        self.step += 1;
        answer
    }

    /// The track so far, with stems.
    pub(crate) fn track(&self) -> Result<Track, SessionError> {
        if self.samples.is_empty() {
            return Err(SessionError::Refused("found the plant in no photograph".to_owned()));
        }
        Ok(Track::of_photographs(self.samples.clone()))
    }

    /// The track so far, as the bytes of a CSV file.
    pub(crate) fn csv(&self) -> Result<Vec<u8>, SessionError> {
        let mut track = self.track()?;
        track.samples.iter_mut().for_each(|sample| sample.stem = None);
        for (name, cells) in ["frame", "class", "confidence"].into_iter().zip(&self.columns) {
            track.columns.push(Column::parsed(name, cells.clone()));
        }
        Ok(track.to_csv())
    }
}
