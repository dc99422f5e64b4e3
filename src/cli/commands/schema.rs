//! `domecast schema`

use super::output::{Failure, Output};

/// Prints the JSON schema of the design file, or of the scene file.
pub fn run(output: &Output, scene: bool) -> Result<(), Failure> {
    if scene {
        let schema = domecast_design::schema_of::<domecast_sim::scene::SceneFile>();
        return output.answer(&format!("{schema:#}\n"));
    }
    output.answer(&format!("{:#}\n", domecast_design::design_schema()))
}
