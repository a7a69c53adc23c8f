//! The virtual tent with small photographs, so that tests through photographs are quick.

use tropism::greenhouse::scene::Scene;
use tropism::greenhouse::tent::Greenhouse;

pub(crate) fn small_tent() -> Greenhouse {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    Greenhouse { scene, ..Greenhouse::default() }
}
