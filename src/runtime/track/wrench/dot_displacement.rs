//! Where the dots are on the dome, less where they are at rest.

use glam::{DVec2, DVec3};

use crate::track::identities::DotTrack;
use crate::track::model::DotModel;
use domecast_optics::{RayLimit, SensorOptics, SurfacePoint};

/// Dots whose rays are traced at a time: a longer slice would be shared among threads.
const TRACE_RUN: usize = 1024;

/// Displacement of each dot in the platform's frame; keeps its buffers.
#[derive(Debug, Clone)]
pub(in crate::track) struct DotDisplacements {
    /// Dots that were found, their centres in the image, and where those are on the dome.
    found: Vec<usize>,
    centers: Vec<DVec2>,
    hits: Vec<Result<SurfacePoint, RayLimit>>,
    displacements_mm: Vec<Option<DVec3>>,
}

impl DotDisplacements {
    /// For so many dots.
    pub fn new(count: usize) -> Self {
        Self {
            found: Vec::with_capacity(count),
            centers: Vec::with_capacity(count),
            hits: Vec::with_capacity(count),
            displacements_mm: vec![None; count],
        }
    }

    /// Each found dot's ray met with the undeformed dome, less its rest position, mm; `optics`: at the platform's pose.
    pub fn at_pose(
        &mut self,
        optics: &SensorOptics,
        models: &[DotModel],
        tracks: &[DotTrack],
    ) -> &[Option<DVec3>] {
        self.found.clear();
        self.centers.clear();
        for (index, track) in tracks.iter().enumerate() {
            if let Some(center) = track.center_px() {
                self.found.push(index);
                self.centers.push(center);
            }
        }
        self.hits.clear();
        self.hits.resize(self.centers.len(), Err(RayLimit::MissesDome));
        for (centers, hits) in self.centers.chunks(TRACE_RUN).zip(self.hits.chunks_mut(TRACE_RUN)) {
            // Slices of one length are all that it asks for.
            let _ = optics.trace_all(centers, hits);
        }
        self.displacements_mm.fill(None);
        for (index, hit) in self.found.iter().zip(&self.hits) {
            if let Ok(hit) = hit {
                self.displacements_mm[*index] = Some(hit.surface_mm - models[*index].surface_mm);
            }
        }
        &self.displacements_mm
    }
}
