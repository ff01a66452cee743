//! Nodes breadth first, each node's neighbours by their degree, else in the order of its springs (Cuthill and McKee 1969), and that order reversed (George
//! 1971): it asks for no positions, and makes rows of most lattices.

use super::links::Links;
use crate::Result;
use crate::base::memory;

/// Walks to the far end of a part before the one that makes the order: the further apart its ends, the narrower it is.
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
    let mut found = Vec::new();
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
            found.clear();
            for (index, &neighbour) in links.of(node).iter().enumerate() {
                if std::mem::replace(&mut marks[neighbour as usize], DONE) != DONE {
                    memory::push(&mut found, (links.degree(neighbour), index, neighbour))?;
                }
            }
            found.sort_unstable();
            order.extend(found.iter().map(|&(.., neighbour)| neighbour));
        }
    }
    order.reverse();
    Ok(order)
}

/// Of the nodes that are the most springs away from `start`, the one with the fewest springs.
fn far_end(start: u32, links: &Links, search: u32, marks: &mut [u32], reached: &mut Vec<u32>) -> u32 {
    reached.clear();
    reached.push(start);
    marks[start as usize] = search;
    // Where the nodes begin that are as far away as the last one.
    let mut level = 0;
    let mut next = 0;
    while next < reached.len() {
        level = next;
        for index in level..reached.len() {
            for &neighbour in links.of(reached[index]) {
                if std::mem::replace(&mut marks[neighbour as usize], search) != search {
                    reached.push(neighbour);
                }
            }
            next = index + 1;
        }
    }
    let farthest = reached[level..].iter().copied();
    farthest.min_by_key(|&node| links.degree(node)).unwrap_or(start)
}
