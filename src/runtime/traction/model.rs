//! The elastic dome as the tracker needs it: what a pressure on each of its nodes moves, and what pressures are likely.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::DMatrix;
use std::sync::Arc;

use crate::constants::Constants;
use crate::track::TrackError;
use domecast_elastic::{Compliance, ElasticDome, SurfaceField};
use domecast_optics::numeric::pseudo_inverse;

/// Elements along the meridian: nodes a sixteenth of it apart, 1 mm on a dome of 10 mm radius.
const ELEMENTS: usize = 16;
/// Standard deviation of the pressure that is expected where something touches, over Young's modulus: Hertz' largest pressure is
/// 2 a / (pi R) of the plane-strain modulus, a half of which is reached where strains are large.
const PRESSURE_OVER_YOUNG: f64 = 0.3;
/// Independent part of the prior's variance, for its inverse.
const NUGGET: f64 = 1e-3;
/// Nodes that a tangent plane is fitted to.
const BESIDE: usize = 8;

/// Directions at a node: the pressure's (inwards), and two along the skin.
pub(super) const AXES: usize = 3;

/// A node that may bear a pressure.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub at_mm: DVec3,
    pub area_mm2: f64,
    /// Inwards and along the skin.
    pub axes: DMat3,
    /// Nodes beside it with the weights that give the skin's derivatives along the second and third axis.
    pub beside: Vec<(usize, f64, f64)>,
}

/// A dot and how its image moves with it.
#[derive(Debug, Clone)]
pub(super) struct Dot {
    /// Its place in the constants, mm.
    pub surface_mm: DVec3,
    /// Where it lies on the untouched dome, mm: by the constants, or as frames of the untouched sensor show it.
    pub rest_mm: DVec3,
    /// Such frames; 0: the constants' place.
    pub rest_frames: u32,
    /// Standard deviation of its image by that of its place in the constants, px.
    pub place_sd_px: f64,
    pub by_point: [DVec3; 2],
    /// Its image on the untouched dome where the platform is now, px.
    pub rest_px: Option<DVec2>,
    /// Its motion in the image by the forces so far, px, what is seen of it, and one over the deviation; 0 where it is not seen.
    pub seen_px: DVec2,
    pub linear_px: DVec2,
    pub per_sd: f64,
}

/// Standard deviation of a dot's image by its place in the constants, px: as it is printed, or as `calibrate-optics` saw it; `by_point`:
/// how the image moves with the point.
pub(super) fn place_sd_px(constants: &Constants, by_point: &[DVec3; 2]) -> f64 {
    let Some(tolerances) = &constants.tolerances else { return 0.0 };
    if constants.optics_uncertainty.is_some() {
        return tolerances.black_centroid_px;
    }
    let squares: f64 = by_point.iter().map(|by| by.length_squared()).sum();
    tolerances.black_dot_mm * (0.5 * squares).sqrt()
}

/// What forces on the nodes move.
#[derive(Debug, Clone)]
pub(super) struct ElasticModel {
    pub nodes: Vec<Node>,
    pub compliance: Arc<Compliance>,
    /// The node of this list for each node of the grid.
    pub of_grid: Vec<Option<usize>>,
    /// Motion of each dot for a traction of 1 N/mm2 on a node along an axis, by axis, node, dot, mm.
    pub dots_mm: Vec<DVec3>,
    /// The same of each node.
    pub nodes_mm: Vec<DVec3>,
    /// Inverse covariance of the nodes' pressures, 1/(N/mm2)^2, row by row.
    pub precision: Vec<f64>,
    /// Over how far pressures are alike, mm.
    pub correlation_mm: f64,
    /// Standard deviation of the prior's pressure, N/mm2.
    pub pressure_sd_n_mm2: f64,
    /// Young's modulus, N/mm2, and its relative standard deviation.
    pub young_mpa: f64,
    pub young_sd_part: f64,
    pub friction: f64,
}

impl ElasticModel {
    /// Of the constants' dome and dots at these places of it, mm. `correlation_mm`: over how far pressures are taken to be alike;
    /// `None`: the dots' distance.
    pub fn new(
        constants: &Constants,
        dots_mm: &[DVec3],
        correlation_mm: Option<f64>,
    ) -> Result<Self, TrackError> {
        let elastomer = constants.elastomer.as_ref().ok_or_else(|| {
            TrackError::at("elastomer", "is not there: constants of an earlier build say nothing of the dome's modulus; build them again")
        })?;
        elastomer.check().map_err(|(field, problem)| TrackError::at(field, problem))?;
        let dome = constants.optics.dome();
        let body =
            ElasticDome { dome, young_mpa: elastomer.young_modulus_mpa, poisson: elastomer.poisson_ratio };
        let compliance = Compliance::new(&body, ELEMENTS)
            .map_err(|error| TrackError::at("elastomer", error.to_string()))?;
        let compliance = Arc::new(compliance);
        let grid = &compliance.grid;
        let spacing_mm = grid.spacing_mm();
        // As far out as dots are, and one ring more.
        let last_rad = dots_mm.iter().map(|at| dome.meridian_rad(*at)).fold(0.0, f64::max);
        let last_rad = last_rad + spacing_mm / dome.radius_mm();
        let chosen: Vec<usize> =
            (0..grid.len()).filter(|number| grid.meridian_rad(grid.node(*number).ring) <= last_rad).collect();
        let mut of_grid = vec![None; grid.len()];
        chosen.iter().enumerate().for_each(|(k, number)| of_grid[*number] = Some(k));
        let outermost = chosen.last().map_or(0, |number| grid.node(*number).ring);
        compliance.reach(outermost).map_err(|error| TrackError::at("elastomer", error.to_string()))?;
        let nodes = nodes_of(&compliance, &chosen);
        let area_mm2: f64 = nodes.iter().map(|node| node.area_mm2).sum();
        let dots_apart_mm = (area_mm2 / dots_mm.len().max(1) as f64).sqrt();
        let correlation_mm = correlation_mm.unwrap_or(dots_apart_mm).max(spacing_mm);
        let pressure_sd_n_mm2 = PRESSURE_OVER_YOUNG * elastomer.young_modulus_mpa;
        let precision = precision_of(&nodes, correlation_mm, pressure_sd_n_mm2)
            .ok_or_else(|| TrackError::at("elastomer", "leaves no likely pressures"))?;
        let model = Self {
            dots_mm: dots_moved(&compliance, &nodes, &chosen, dots_mm),
            nodes_mm: nodes_moved(&compliance, &nodes, &chosen),
            young_mpa: elastomer.young_modulus_mpa,
            young_sd_part: elastomer.young_modulus_sd_mpa / elastomer.young_modulus_mpa,
            friction: elastomer.friction,
            nodes,
            of_grid,
            precision,
            correlation_mm,
            pressure_sd_n_mm2,
            compliance,
        };
        Ok(model)
    }

    /// By how much each node stands out for a traction of 1 N/mm2 on a node along an axis, by axis, node, node, mm.
    pub fn heights_by(&self) -> Vec<f64> {
        let by_one = self.nodes_mm.chunks_exact(self.nodes.len().max(1));
        by_one
            .flat_map(|moved| self.nodes.iter().zip(moved).map(|(node, u)| -node.axes.x_axis.dot(*u)))
            .collect()
    }

    /// Variance of the pressure within half a node's distance of a node, (N/mm2)^2: half of what it differs by from the nodes beside it.
    pub fn variance_within(&self, node: usize, pressures: &[f64]) -> f64 {
        let (beside, own) = (&self.nodes[node].beside, pressures[node]);
        let squares = beside.iter().map(|(other, ..)| (0.5 * (pressures[*other] - own)).powi(2));
        squares.sum::<f64>() / beside.len().max(1) as f64
    }

    /// Nodes of the list about a point of the dome, with their shares.
    pub fn about(&self, at_mm: DVec3) -> impl Iterator<Item = (usize, f64)> + '_ {
        let parts = self.compliance.grid.hats_at(at_mm);
        parts.into_iter().filter_map(|(number, share)| {
            let node = self.of_grid.get(number).copied().flatten()?;
            (share > 0.0).then_some((node, share))
        })
    }
}

fn nodes_of(compliance: &Compliance, chosen: &[usize]) -> Vec<Node> {
    let grid = &compliance.grid;
    let places: Vec<DVec3> = chosen.iter().map(|number| grid.place(grid.node(*number))).collect();
    let node = |(number, at_mm): (&usize, &DVec3)| {
        let inward = -grid.dome.normal(*at_mm);
        let (first, second) = inward.any_orthonormal_pair();
        let mut near: Vec<(f64, usize)> =
            places.iter().enumerate().map(|(k, place)| (place.distance_squared(*at_mm), k)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let beside: Vec<usize> = near.iter().take(BESIDE + 1).map(|(_, k)| *k).collect();
        Node {
            at_mm: *at_mm,
            area_mm2: grid.areas_mm2[grid.node(*number).ring],
            axes: DMat3::from_cols(inward, first, second),
            beside: slopes(&places, &beside, *at_mm, first, second),
        }
    };
    chosen.iter().zip(&places).map(node).collect()
}

/// Weights of the values at some places that give the derivatives along two axes of the quadratic through them, by least squares.
fn slopes(
    places: &[DVec3],
    beside: &[usize],
    at_mm: DVec3,
    first: DVec3,
    second: DVec3,
) -> Vec<(usize, f64, f64)> {
    let row = |k: usize| {
        let arm = places[k] - at_mm;
        let (x, y) = (arm.dot(first), arm.dot(second));
        [1.0, x, y, x * x, x * y, y * y]
    };
    let matrix = DMatrix::from_fn(beside.len(), 6, |i, j| row(beside[i])[j]);
    let inverse = pseudo_inverse(matrix, 1e-9).unwrap_or_else(|| DMatrix::zeros(6, beside.len()));
    beside.iter().enumerate().map(|(i, k)| (*k, inverse[(1, i)], inverse[(2, i)])).collect()
}

/// Inverse of a Gaussian process's covariance over the nodes.
fn precision_of(nodes: &[Node], correlation_mm: f64, sd: f64) -> Option<Vec<f64>> {
    let n = nodes.len();
    let alike = |i: usize, j: usize| {
        let q = nodes[i].at_mm.distance_squared(nodes[j].at_mm) / (2.0 * correlation_mm * correlation_mm);
        sd * sd * ((-q).exp() + if i == j { NUGGET } else { 0.0 })
    };
    let covariance = DMatrix::from_fn(n, n, alike);
    Some(covariance.cholesky()?.inverse().as_slice().to_vec())
}

/// What tractions on the nodes move the dots by; nodes of a ring have one field, turned.
fn dots_moved(
    compliance: &Arc<Compliance>,
    nodes: &[Node],
    chosen: &[usize],
    dots_mm: &[DVec3],
) -> Vec<DVec3> {
    let grid = &compliance.grid;
    let mut moved = vec![DVec3::ZERO; AXES * nodes.len() * dots_mm.len()];
    let mut fields: Vec<(usize, [SurfaceField; 3])> = Vec::new();
    for (k, (node, number)) in nodes.iter().zip(chosen).enumerate() {
        let place = grid.node(*number);
        let first = grid.first[place.ring];
        if fields.last().is_none_or(|(ring, _)| *ring != place.ring) {
            let field = |axis: DVec3| SurfaceField::new(Arc::clone(compliance), vec![(first, axis)]);
            fields.push((place.ring, [field(DVec3::X), field(DVec3::Y), field(DVec3::Z)]));
        }
        let Some((_, fields)) = fields.last() else { continue };
        let turn = DMat3::from_rotation_z(grid.azimuth(place));
        let local = grid.frame(place).transpose() * node.axes;
        for (d, dot) in dots_mm.iter().enumerate() {
            let there = turn.transpose() * *dot;
            let by = DMat3::from_cols(fields[0].at(there), fields[1].at(there), fields[2].at(there));
            let by = turn * by * local * node.area_mm2;
            for (axis, moved_mm) in [by.x_axis, by.y_axis, by.z_axis].into_iter().enumerate() {
                moved[(axis * nodes.len() + k) * dots_mm.len() + d] = moved_mm;
            }
        }
    }
    moved
}

fn nodes_moved(compliance: &Compliance, nodes: &[Node], chosen: &[usize]) -> Vec<DVec3> {
    let (grid, n) = (&compliance.grid, nodes.len());
    let framed: Vec<_> =
        chosen.iter().map(|number| (grid.node(*number), grid.frame(grid.node(*number)))).collect();
    let mut moved = vec![DVec3::ZERO; AXES * n * n];
    for (k, node) in nodes.iter().enumerate() {
        let (by, frame) = framed[k];
        let local = frame.transpose() * node.axes * node.area_mm2;
        for (i, (at, other)) in framed.iter().enumerate() {
            let u = *other * compliance.between(*at, by) * local;
            for (axis, moved_mm) in [u.x_axis, u.y_axis, u.z_axis].into_iter().enumerate() {
                moved[(axis * n + k) * n + i] = moved_mm;
            }
        }
    }
    moved
}
