//! Reverse Cuthill-McKee order: breadth first with neighbors sorted by degree (Cuthill and McKee 1969), then reversed
//! (George 1971). It needs no positions and makes rows of most lattices.

use super::links::Links;
use crate::Result;
use crate::base::memory;

/// The number of searches for a far end of a component before ordering. A start at an extremal node gives narrow
/// levels.
const SEARCHES: u32 = 2;

/// Marks nodes that are in the order.
const DONE: u32 = u32::MAX;

/// The nodes in reverse Cuthill-McKee order.
pub(super) fn reverse_cuthill_mckee(links: &Links) -> Result<Vec<u32>> {
    let count = links.node_count();
    // The last search that reached each node.
    let mut marks = memory::filled(0, count)?;
    let mut reached = memory::reserved(count)?;
    let mut order: Vec<u32> = memory::reserved(count)?;
    let mut new_neighbors = Vec::new();
    for node in 0..count as u32 {
        if marks[node as usize] == DONE {
            continue;
        }
        let mut start = node;
        for search in 1..=SEARCHES {
            start = far_end(start, links, search, &mut marks, &mut reached);
        }
        let mut next = order.len();
        marks[start as usize] = DONE;
        order.push(start);
        while let Some(&node) = order.get(next) {
            next += 1;
            new_neighbors.clear();
            for (index, &neighbor) in links.neighbors(node).iter().enumerate() {
                if std::mem::replace(&mut marks[neighbor as usize], DONE) != DONE {
                    memory::push(&mut new_neighbors, (links.degree(neighbor), index, neighbor))?;
                }
            }
            new_neighbors.sort_unstable();
            order.extend(new_neighbors.iter().map(|&(.., neighbor)| neighbor));
        }
    }
    order.reverse();
    Ok(order)
}

/// The node with the fewest springs among those at the largest graph distance from `start`.
fn far_end(start: u32, links: &Links, search: u32, marks: &mut [u32], reached: &mut Vec<u32>) -> u32 {
    reached.clear();
    reached.push(start);
    marks[start as usize] = search;
    // The start of the current breadth-first level.
    let mut level = 0;
    let mut next = 0;
    while next < reached.len() {
        level = next;
        for index in level..reached.len() {
            for &neighbor in links.neighbors(reached[index]) {
                if std::mem::replace(&mut marks[neighbor as usize], search) != search {
                    reached.push(neighbor);
                }
            }
            next = index + 1;
        }
    }
    let farthest = reached[level..].iter().copied();
    farthest.min_by_key(|&node| links.degree(node)).unwrap_or(start)
}
