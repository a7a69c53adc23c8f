//! What a photograph costs, small and large, and what the tent behind it costs once.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use tropism::lamps::Light;
use tropism_bean::pose::{Leaf, Node, Pose};
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;

/// A bean of 25 cm that leans to one side, its leaves half open.
fn bean() -> Pose {
    let mut at = [0.0, 0.0, 0.0];
    let mut stem = Vec::new();
    for segment in 0..=50 {
        let share = f64::from(segment) / 50.0;
        stem.push(Node { at, radius: 0.17 - 0.06 * share });
        let along = [1.2 * share, 1.0, 0.3 * share];
        let length = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]).sqrt();
        at = core::array::from_fn(|axis| at[axis] + 0.5 * along[axis] / length);
    }
    let leaf = |sign: f64| Leaf {
        base: stem[44].at,
        along: [0.8 * sign, 0.0, 0.6 * sign],
        across: [-0.6, 0.0, 0.8],
        length: 4.0,
    };
    Pose {
        age_h: 40.0,
        heading: [0.75, 0.63, 0.2],
        leaves: [leaf(1.0), leaf(-1.0)],
        spread: 0.8,
        withered: 0.4,
        stem,
    }
}

fn photographs(criterion: &mut Criterion) {
    let pose = bean();
    for (width, height) in [(648, 486), (2592, 1944)] {
        let scene = Scene { width, height, ..Scene::default() };
        let mut group = criterion.benchmark_group(format!("{width}x{height}"));
        group.sample_size(30);
        let mut renderer = Renderer::new(&scene, 1);
        let mut frame = 0;
        group.bench_function("draw", |bencher| {
            bencher.iter(|| {
                frame += 1;
                black_box(renderer.draw(&pose, Some(Light::LEFT), true, frame))
            });
        });
        group.bench_function("photograph", |bencher| {
            bencher.iter(|| {
                frame += 1;
                black_box(renderer.photograph(&pose, Some(Light::LEFT), true, frame))
            });
        });
        group.finish();
    }
    let scene = Scene::default();
    criterion.bench_function("a new tent and its first photograph", |bencher| {
        bencher.iter(|| black_box(Renderer::new(&scene, 1).draw(&pose, Some(Light::RIGHT), true, 0)));
    });
}

criterion_group!(benches, photographs);
criterion_main!(benches);
