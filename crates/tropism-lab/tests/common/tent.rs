//! The virtual tent with small photographs, so that tests through photographs are quick.

use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;

pub(crate) fn small_tent() -> Greenhouse {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    Greenhouse { scene, ..Greenhouse::default() }
}
