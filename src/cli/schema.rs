//! `domecast schema`

use super::output::{Failure, Output};

/// Prints the JSON schema of the design file, or of the scene file.
pub fn run(output: &Output, scene: bool) -> Result<(), Failure> {
    if scene {
        let schema = crate::design::schema_of::<crate::sim::scene::SceneFile>();
        return output.answer(&format!("{schema:#}\n"));
    }
    output.answer(&format!("{:#}\n", crate::design::design_schema()))
}
