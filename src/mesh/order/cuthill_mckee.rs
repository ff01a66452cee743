//! Reverse Cuthill-McKee.
use super::links::Links;
use crate::Result;
use crate::memory;

pub(super) fn reverse_cuthill_mckee(links: &Links) -> Result<Vec<u32>> {
    let count = links.node_count();
    let mut stamp = memory::filled(0_u32, count)?;
    let mut order: Vec<u32> = memory::reserved(count)?;
    let mut level: Vec<u32> = memory::reserved(count)?;
    let mut children: Vec<u32> = memory::reserved(count)?;
    for node in 0..count as u32 {
        if stamp[node as usize] == u32::MAX {
            continue;
        }
        let mut start = node;
        for round in 1..=3 {
            // last node of a breadth-first walk; least degree in the last level
            level.clear();
            level.push(start);
            stamp[start as usize] = round;
            let (mut next, mut level_start, mut level_end) = (0, 0, 1);
            while next < level.len() {
                if next == level_end {
                    level_start = level_end;
                    level_end = level.len();
                }
                let n = level[next];
                next += 1;
                for &m in links.of(n) {
                    if stamp[m as usize] != round {
                        stamp[m as usize] = round;
                        level.push(m);
                    }
                }
            }
            if level_start == level_end { level_start = 0; }
            start = *level[level_start..].iter().min_by_key(|&&n| links.degree(n)).unwrap_or(&start);
        }
        let mut next = order.len();
        order.push(start);
        stamp[start as usize] = u32::MAX;
        while let Some(&n) = order.get(next) {
            next += 1;
            children.clear();
            for &m in links.of(n) {
                if stamp[m as usize] != u32::MAX {
                    stamp[m as usize] = u32::MAX;
                    children.push(m);
                }
            }
            children.sort_by_key(|&m| links.degree(m));
            order.extend_from_slice(&children);
        }
    }
    order.reverse();
    Ok(order)
}
