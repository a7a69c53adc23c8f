//! Silhouettes of bean shoots with their published midlines: thresholds were chosen on those with odd numbers.

use std::path::Path;

use rayon::prelude::*;
use tropism::math::statistics::quantile_nearest;
use tropism::photo::Photo;
use tropism::vision::Frame;
use tropism::vision::Mode;

use super::alone_in;
use crate::published::{self, Shoot};
use crate::reliability::Reliability;
use crate::share::Share;

pub(super) fn print(folder: &Path, suffix: &str, mode: Mode, _: &mut Reliability) {
    let folder = folder.join("bean-silhouettes");
    let is_odd = |number: &String| number.ends_with(['1', '3', '5', '7', '9']);
    let half: Vec<String> =
        published::shoots(&folder).into_iter().filter(|number| is_odd(number) == suffix.is_empty()).collect();
    let of_library = |number: &String| published::library_midline(&folder, number);
    let of_track = |number: &String| {
        published::midline(&folder, number, |image, base| {
            let photo = Photo { name: number.clone(), bytes: image.to_jpeg(95).ok()?, time_s: 0.0 };
            alone_in(&Frame::new(photo), base, mode).measured()?.stem.clone()
        })
    };
    let library: Vec<Option<[Shoot; 2]>> = half.par_iter().map(of_library).collect();
    let track: Vec<Option<[Shoot; 2]>> = half.par_iter().map(of_track).collect();
    for (name, found) in [("through track", &track), ("library call", &library)] {
        let answered = Share::of(found.iter().map(Option::is_some));
        let known = || found.iter().flatten();
        let quantiles = |which: usize, value: fn(&Shoot) -> f64| {
            let values: Vec<f64> = known().map(|one| value(&one[which])).collect();
            [0.5, 1.0].map(|share| quantile_nearest(&values, share))
        };
        let [distance, worst_distance] = quantiles(0, |one| one.distance);
        let [length, worst_length] = quantiles(0, |one| one.length.abs());
        let [between, worst_between] = quantiles(0, |one| one.between.abs());
        let [smoothed, _] = quantiles(1, |one| one.length.abs());
        println!(
            "  {name:18} answered {answered} | distance median {distance:.2} %, worst {worst_distance:.2} % | length end \
             to end off by median {length:.2} %, worst {worst_length:.2} %, between the published line's ends \
             {between:.2} %, worst {worst_between:.2} %, smoothed as that is {smoothed:.2} %"
        );
    }
}
