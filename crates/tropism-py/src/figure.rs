//! Pictures of tracks, models and genomes, for notebooks: SVG with its own style sheet.

use pyo3::prelude::*;
use tropism::observation::Quality;
use tropism::plant::FittedModel;
use tropism::plant::tip::TipModel;
use tropism::simulation::{AnyModel, ModelKind};
use tropism::track::Sample;
use tropism_report::{Plants, in_one_svg, network, shift_maps, trajectories};

use crate::error::refused;
use crate::track::Track;

const fn plants(is_virtual: bool) -> Plants {
    if is_virtual { Plants::Virtual } else { Plants::Real }
}

/// The paths of the tips of tracks (Fig. 4a), as SVG.
#[pyfunction]
#[pyo3(signature = (tracks, is_virtual=false))]
pub(crate) fn draw_tracks(tracks: Vec<PyRef<'_, Track>>, is_virtual: bool) -> String {
    let tracks: Vec<_> = tracks.iter().map(|track| track.0.clone()).collect();
    in_one_svg(&[trajectories(&tracks, plants(is_virtual))])
}

/// The tip-motion model in a model file's JSON.
pub(crate) fn tip_model(model: &AnyModel) -> PyResult<TipModel> {
    if model.kind() != ModelKind::TIP {
        return Err(refused(format!(
            "found a model of kind {:?}, wanted one of kind \"tip\": others have no observed shifts and no table",
            model.kind().name()
        )));
    }
    TipModel::from_json(&model.to_json()).map_err(refused)
}

/// Maps of the mean shifts of a tip-motion model (Fig. 5), as SVG.
pub(crate) fn draw_shifts(model: &AnyModel) -> PyResult<String> {
    let model = tip_model(model)?;
    // Each shift is a step of its own; in the dark row after it nothing is measured.
    let samples = model.observed().iter().zip(0_u32..).flat_map(|(shift, number)| {
        let sample = |step, tip, light| Sample {
            step,
            time_s: 0.0,
            tip,
            stem: None,
            depth: None,
            light,
            levels: None,
            quality: Quality::Measured,
        };
        let mut end = shift.tip;
        (end.x, end.y) = (end.x + shift.dx, end.y + shift.dy);
        [sample(2 * number, shift.tip, Some(shift.light)), sample(2 * number + 1, end, None)]
    });
    let layout = tropism::plant::PlantModel::layout(&model).clone();
    let track = tropism::track::Track { layout, ..tropism::track::Track::of(samples.collect()) };
    Ok(in_one_svg(&shift_maps(&[track], plants(model.is_virtual()))))
}

/// A genome with its neurons and links, as SVG; one that is too large to draw says so.
pub(crate) fn draw_genome(genome: &tropism_neat::Genome) -> PyResult<String> {
    match tropism_report::too_large_to_draw(genome) {
        Some(reason) => Err(refused(reason)),
        None => Ok(in_one_svg(&[network(genome)])),
    }
}
