//! A tree of boxes over triangles, for whatever looks for one of them.

use glam::DVec3;

/// What a tree is grown over.
pub trait Cornered {
    /// Its corners.
    fn corners(&self) -> [DVec3; 3];
}

impl Cornered for [DVec3; 3] {
    fn corners(&self) -> [DVec3; 3] {
        *self
    }
}

/// A tree of boxes over triangles that stand in an order of its own.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
}

/// A box of the tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub low: DVec3,
    pub high: DVec3,
    /// Triangles `first..first + count` of a leaf; for a branch `count` is 0,
    /// its first child is the next node, and `first` is its second child.
    pub first: u32,
    pub count: u32,
}

const LEAF: usize = 4;
/// Deepest way down the tree: every level halves its triangles, whose number fits into 32 bits, and leaves one
/// sibling waiting.
pub(super) const STACK: usize = 36;

/// Room for the rounding of a squared distance to a box.
const ROUNDING: f64 = 1.0 + 1e-12;

impl BoxTree {
    /// A tree over some triangles, which it puts into its order.
    pub fn over<T: Cornered>(triangles: &mut [T]) -> Self {
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            grow(triangles, 0, triangles.len(), &mut nodes);
        }
        Self { nodes }
    }

    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The box of everything; `None` where there is nothing.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.nodes.first().map(|root| (root.low, root.high))
    }

    /// Tells `look` of every triangle whose box may be as near to a point as the nearest one so far. It answers with
    /// the square of the smallest distance that it has seen; `within` is one that it knows already, or infinity.
    pub fn nearest(&self, point: DVec3, within: f64, mut look: impl FnMut(usize) -> f64) {
        let mut best = within;
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let (mut index, reach) = stack[depth];
            if reach > best * ROUNDING {
                continue;
            }
            // Down to a leaf, the nearer child first.
            while let Some(node) = self.nodes.get(index as usize) {
                if node.count > 0 {
                    for at in node.first as usize..(node.first + node.count) as usize {
                        best = best.min(look(at));
                    }
                    break;
                }
                let (left, right) = (index + 1, node.first);
                let (a, b) = (self.distance2(left, point), self.distance2(right, point));
                let (near, far) = if a <= b { ((left, a), (right, b)) } else { ((right, b), (left, a)) };
                if far.1 <= best * ROUNDING
                    && let Some(place) = stack.get_mut(depth)
                {
                    *place = far;
                    depth += 1;
                }
                if near.1 > best * ROUNDING {
                    break;
                }
                index = near.0;
            }
        }
    }

    fn distance2(&self, index: u32, point: DVec3) -> f64 {
        self.nodes.get(index as usize).map_or(f64::INFINITY, |node| {
            (node.low - point).max(point - node.high).max(DVec3::ZERO).length_squared()
        })
    }
}

/// Builds the subtree of a range of triangles; splits at the median of the
/// longest side, which depends on nothing but the triangles.
fn grow<T: Cornered>(triangles: &mut [T], start: usize, count: usize, nodes: &mut Vec<Node>) {
    let part = &mut triangles[start..start + count];
    let corners = || part.iter().flat_map(T::corners);
    let low = corners().fold(DVec3::splat(f64::INFINITY), DVec3::min);
    let high = corners().fold(DVec3::splat(f64::NEG_INFINITY), DVec3::max);
    let here = nodes.len();
    nodes.push(Node { low, high, first: start as u32, count: count as u32 });
    if count <= LEAF {
        return;
    }
    let size = high - low;
    let axis = if size.x >= size.y.max(size.z) {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = |t: &T| t.corners().iter().map(|corner| corner[axis]).sum::<f64>();
    let half = count / 2;
    part.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
    grow(triangles, start, half, nodes);
    let second = nodes.len() as u32;
    grow(triangles, start + half, count - half, nodes);
    if let Some(node) = nodes.get_mut(here) {
        *node = Node { low, high, first: second, count: 0 };
    }
}
