//! The constants of plants in the page: `tropism measure` of a track, to the bit, without its self-check.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use tropism::measure::{Estimate, Options, Quantity, StemRecord, Stimulus, group, measure};
use tropism::observation::Quality;
use tropism::track::Track;
use tropism_page::figure;
use tropism_report::{self as report, MeasuredPlant, Plants};

use crate::SessionError;

/// The constants of the plant of a track, and its figures; `tilt_deg` is the angle by which its pot was tipped at the first row.
pub(crate) fn plant(name: &str, track: &Track, tilt_deg: Option<f64>) -> Result<Value, SessionError> {
    if let Some(tilt) = tilt_deg.filter(|tilt| !(1.0..=180.0).contains(tilt)) {
        return Err(SessionError::Refused(format!("found a tilt of {tilt} degrees, wanted 1 to 180")));
    }
    let record = StemRecord::of(track)?;
    let stimulus = tilt_deg.map_or(Stimulus::None, Stimulus::Tilt);
    let measurement = measure(&record, &Options { stimulus, ..Options::default() });
    let is_virtual = track.samples.iter().any(|sample| sample.quality == Quality::Simulated);
    let kind = if is_virtual { Plants::Virtual } else { Plants::Real };
    let measured = MeasuredPlant { name, record: &record, measurement: &measurement };
    let mut figures = report::kymographs(measured, kind);
    figures.push(report::fitted_stems(measured, kind));
    Ok(json!({
        "name": name,
        "is_virtual": is_virtual,
        "frames": record.quality,
        "hours": record.duration_h(),
        "responds": measurement.responds,
        "estimates": measurement.estimates.iter().map(shown).collect::<Vec<_>>(),
        "figures": figures.into_iter().filter_map(figure).collect::<Vec<_>>(),
    }))
}

/// Means of plants, with intervals: the values of each constant.
pub(crate) fn means(values: &BTreeMap<String, Vec<f64>>) -> Value {
    let of = |(symbol, values): (&String, &Vec<f64>)| shown(&group::mean_of(symbol, values));
    let is_known =
        |symbol: &str| tropism::measure::estimate::QUANTITIES.iter().any(|one| one.symbol == symbol);
    values.iter().filter(|(symbol, _)| is_known(symbol)).map(of).collect::<Vec<_>>().into()
}

fn shown(estimate: &Estimate) -> Value {
    let Quantity { unit, words, .. } = Quantity::of(&estimate.symbol);
    json!({
        "symbol": estimate.symbol,
        "words": words,
        "unit": unit,
        "value": estimate.value,
        "interval": estimate.interval,
        "status": estimate.status,
        "has_value": estimate.status.has_value(),
        "reason": estimate.reason,
    })
}
