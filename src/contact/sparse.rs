//! The pattern of a stiffness matrix.

/// Column starts and rows of the lower triangle, three unknowns a node, columns in order; `neighbours` are the nodes
/// that each node shares an element with, itself among them. The diagonal is each column's first entry.
pub(super) fn lower_triangle(neighbours: Vec<Vec<usize>>) -> (Vec<usize>, Vec<usize>) {
    let (mut columns, mut rows) = (vec![0], Vec::new());
    for (node, mut list) in neighbours.into_iter().enumerate() {
        list.sort_unstable();
        list.dedup();
        for direction in 0..3 {
            let column = 3 * node + direction;
            rows.extend(list.iter().flat_map(|n| 3 * n..3 * n + 3).filter(|row| *row >= column));
            columns.push(rows.len());
        }
    }
    (columns, rows)
}
