//! Quadratic programs over forces that each have their own bounds.
//!
//! min 1/2 x'Ax + c'x, A symmetric positive definite, with every block of x in its own convex set: a pressure >= 0,
//! or a friction force of two components within a disc. Gradient A x + c is the gap, or the slip. Solved by
//! conjugate gradients on the blocks inside their sets and projected gradient steps that change which those are
//! (Z. Dostal, J. Schoeberl, Comput. Optim. Appl. 30, 2005, and for discs Z. Dostal, T. Kozubek, Math. Program.
//! 135, 2012); the projected steps alone converge, so the mix does.

/// Where a block of unknowns must stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Bounds<'a> {
    /// Blocks of one: x >= 0.
    Positive,
    /// Blocks of two: |x| <= the radius of the block.
    Discs(&'a [f64]),
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ended {
    pub iterations: u32,
    /// Largest entry of the projected gradient.
    pub residual: f64,
    pub converged: bool,
}

/// A symmetric matrix, row by row, and its product.
pub(super) struct Dense {
    pub n: usize,
    pub values: Vec<f64>,
}

impl Dense {
    pub fn times(&self, x: &[f64], out: &mut [f64]) {
        for (row, out) in self.values.chunks_exact(self.n.max(1)).zip(out) {
            *out = dot(row, x);
        }
    }
}

/// A sum of products in four lanes, in a fixed order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            lanes[k] += x[k] * y[k];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

impl Bounds<'_> {
    fn size(self) -> usize {
        match self {
            Self::Positive => 1,
            Self::Discs(_) => 2,
        }
    }

    fn project(self, block: usize, x: &mut [f64]) {
        match self {
            Self::Positive => x[0] = x[0].max(0.0),
            Self::Discs(radii) => {
                let length = x[0].hypot(x[1]);
                if length > radii[block] {
                    let scale = radii[block] / length;
                    x[0] *= scale;
                    x[1] *= scale;
                }
            }
        }
    }

    fn is_free(self, block: usize, x: &[f64]) -> bool {
        match self {
            Self::Positive => x[0] > 0.0,
            Self::Discs(radii) => x[0].hypot(x[1]) < radii[block] * (1.0 - 1e-12),
        }
    }

    /// The part of the gradient that a block on its border may still follow inwards or along.
    fn chop(self, x: &[f64], g: &mut [f64]) {
        match self {
            Self::Positive => g[0] = g[0].min(0.0),
            Self::Discs(_) => {
                let length = x[0].hypot(x[1]);
                if length > 0.0 {
                    let (nx, ny) = (x[0] / length, x[1] / length);
                    let outwards = (g[0] * nx + g[1] * ny).min(0.0);
                    g[0] -= outwards * nx;
                    g[1] -= outwards * ny;
                } else {
                    g.fill(0.0);
                }
            }
        }
    }

    /// Longest step x - t p that stays in the set.
    fn room(self, block: usize, x: &[f64], p: &[f64]) -> f64 {
        match self {
            Self::Positive => {
                if p[0] > 0.0 {
                    x[0] / p[0]
                } else {
                    f64::INFINITY
                }
            }
            Self::Discs(radii) => {
                let (pp, xp) = (p[0] * p[0] + p[1] * p[1], x[0] * p[0] + x[1] * p[1]);
                let inside = radii[block] * radii[block] - x[0] * x[0] - x[1] * x[1];
                if pp > 0.0 { (xp + (xp * xp + pp * inside.max(0.0)).sqrt()) / pp } else { f64::INFINITY }
            }
        }
    }
}

/// An upper estimate of the largest eigenvalue: the largest row sum bounds it; power steps bring it down.
fn largest_eigenvalue(a: &Dense) -> f64 {
    let mut x = vec![1.0 / (a.n.max(1) as f64).sqrt(); a.n];
    let mut y = vec![0.0; a.n];
    let mut value = 0.0;
    for _ in 0..12 {
        a.times(&x, &mut y);
        value = dot(&y, &y).sqrt();
        if value.is_nan() || value <= 0.0 {
            break;
        }
        for (x, y) in x.iter_mut().zip(&y) {
            *x = y / value;
        }
    }
    value
}

/// Sweeps go this much farther than their own best; between 0 and 2 they converge.
const RELAXATION: f64 = 1.4;

/// Friction by sweeps: every block in turn goes to the best place in its disc, the others held (projected
/// Gauss-Seidel). The discs' borders are curved, so that conjugate gradients would forever be cut short there.
fn sweep(a: &Dense, c: &[f64], radii: &[f64], x: &mut [f64], tolerance: f64, most: u32) -> Ended {
    let n = a.n;
    let blocks = Bounds::Discs(radii);
    for (block, x) in x.chunks_exact_mut(2).enumerate() {
        blocks.project(block, x);
    }
    let mut residual = f64::INFINITY;
    let mut iterations = 0;
    while residual > tolerance && iterations < most {
        iterations += 1;
        residual = 0.0;
        for block in 0..radii.len() {
            let i = 2 * block;
            let (row_u, row_v) = (&a.values[i * n..(i + 1) * n], &a.values[(i + 1) * n..(i + 2) * n]);
            let g = [dot(row_u, x) + c[i], dot(row_v, x) + c[i + 1]];
            // The block's own 2x2: half trace and half spread give its largest eigenvalue.
            let (uu, vv, uv) = (row_u[i], row_v[i + 1], row_u[i + 1]);
            let largest = 0.5 * (uu + vv) + (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt();
            let old = [x[i], x[i + 1]];
            x[i] -= RELAXATION * g[0] / largest;
            x[i + 1] -= RELAXATION * g[1] / largest;
            blocks.project(block, &mut x[i..i + 2]);
            residual = residual.max(largest * (x[i] - old[0]).hypot(x[i + 1] - old[1]));
        }
    }
    Ended { iterations, residual, converged: residual <= tolerance }
}

/// Solves in place from a start; `tolerance` is compared with the largest entry of the projected gradient.
pub(super) fn solve(
    a: &Dense,
    c: &[f64],
    bounds: Bounds<'_>,
    x: &mut [f64],
    tolerance: f64,
    most_iterations: u32,
) -> Ended {
    if let Bounds::Discs(radii) = bounds {
        return sweep(a, c, radii, x, tolerance, most_iterations);
    }
    let (n, size) = (a.n, bounds.size());
    for (block, x) in x.chunks_exact_mut(size).enumerate() {
        bounds.project(block, x);
    }
    let gradient = |x: &[f64], g: &mut Vec<f64>| {
        a.times(x, g);
        for (g, c) in g.iter_mut().zip(c) {
            *g += c;
        }
    };
    let mut g = vec![0.0; n];
    gradient(x, &mut g);
    // The estimate is from below: 1.5 instead of 2 leaves it room.
    let step = 1.5 / largest_eigenvalue(a).max(f64::MIN_POSITIVE);
    let (mut free, mut chopped, mut p, mut ap) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let split = |x: &[f64], g: &[f64], free: &mut [f64], chopped: &mut [f64]| {
        free.copy_from_slice(g);
        chopped.copy_from_slice(g);
        for (block, x) in x.chunks_exact(size).enumerate() {
            let range = block * size..(block + 1) * size;
            if bounds.is_free(block, x) {
                chopped[range].fill(0.0);
            } else {
                free[range.clone()].fill(0.0);
                bounds.chop(x, &mut chopped[range]);
            }
        }
    };
    split(x, &g, &mut free, &mut chopped);
    p.copy_from_slice(&free);
    let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    let mut residual = largest(&free).max(largest(&chopped));
    let mut iterations = 0;
    while residual > tolerance && iterations < most_iterations {
        iterations += 1;
        if dot(&chopped, &chopped) <= dot(&free, &free) {
            a.times(&p, &mut ap);
            let curvature = dot(&p, &ap);
            let wanted = if curvature > 0.0 { dot(&g, &p) / curvature } else { 0.0 };
            let room = x
                .chunks_exact(size)
                .zip(p.chunks_exact(size))
                .enumerate()
                .map(|(block, (x, p))| bounds.room(block, x, p))
                .fold(f64::INFINITY, f64::min);
            let go = wanted.min(room);
            for i in 0..n {
                x[i] -= go * p[i];
                g[i] -= go * ap[i];
            }
            if wanted <= room && curvature > 0.0 {
                split(x, &g, &mut free, &mut chopped);
                let turn = dot(&free, &ap) / curvature;
                for i in 0..n {
                    p[i] = free[i] - turn * p[i];
                }
            } else {
                // A block met its border: a projected step lets others follow it.
                split(x, &g, &mut free, &mut chopped);
                for i in 0..n {
                    x[i] -= step * free[i];
                }
                for (block, x) in x.chunks_exact_mut(size).enumerate() {
                    bounds.project(block, x);
                }
                gradient(x, &mut g);
                split(x, &g, &mut free, &mut chopped);
                p.copy_from_slice(&free);
            }
        } else {
            for i in 0..n {
                x[i] -= step * (chopped[i] + free[i]);
            }
            for (block, x) in x.chunks_exact_mut(size).enumerate() {
                bounds.project(block, x);
            }
            gradient(x, &mut g);
            split(x, &g, &mut free, &mut chopped);
            p.copy_from_slice(&free);
        }
        residual = largest(&free).max(largest(&chopped));
    }
    Ended { iterations, residual, converged: residual <= tolerance }
}
