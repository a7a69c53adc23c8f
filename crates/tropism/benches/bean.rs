//! What a bean costs: 1000 steps of five minutes without photographs.

use criterion::{Criterion, criterion_group, criterion_main};
use tropism::greenhouse::bean::{Bean, Species, acceptance, lamp_powers};

fn bean(criterion: &mut Criterion) {
    let species = Species::default();
    criterion.bench_function("bean, 1000 steps", |bencher| {
        bencher.iter(|| {
            let mut bean = Bean::new(species.draw(1, 1.0), 1);
            for step in 0..1000 {
                bean.advance(&lamp_powers(Some(acceptance::alternating(step))), 5.0);
            }
            bean.apex()
        });
    });
    criterion.bench_function("bean, 1000 steps, tracked", |bencher| {
        bencher.iter(|| acceptance::open_loop_experiment(&species, 1));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = bean
}
criterion_main!(benches);
