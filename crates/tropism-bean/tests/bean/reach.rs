//! How far virtual beans get to the side.

use tropism::geometry::Point;
use tropism::task::Task;
use tropism_bean::{Reach, Species};

#[test]
fn far_targets_are_out_of_reach_and_near_ones_are_not() {
    let reach = Species::default().reach();
    let of =
        |rows: &[[f64; 2]], height: f64| rows.iter().find(|[y, _]| *y >= height).map_or(0.0, |[_, x]| *x);
    let Reach { tips, stems, lean_deg } = &reach;
    // The paper's targets were reached by real plants.
    assert!(reach.out_of_reach(&Task::default()).is_empty(), "{tips:?}");
    assert!(reach.misses_tip(Point::new(-9.0, 5.0)).is_some_and(|why| why.contains("on the left")));
    // A grown stem leans, its root does not. It lies about as far as its tip was, but for how it straightened since.
    assert!((20.0..90.0).contains(lean_deg), "{lean_deg}");
    assert!(stems[0][0] < 1.0 && of(stems, 1.0) < 1.0, "{stems:?}");
    assert!(
        (5..14).map(f64::from).all(|height| of(stems, height) > of(tips, height) - 1.0),
        "{stems:?} {tips:?}"
    );
}
