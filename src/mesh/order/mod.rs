//! The order in which packed storage keeps nodes for itself: one that makes neighbours neighbours.

mod cost;
mod cuthill_mckee;
mod hilbert;
mod links;
mod rows;

use glam::Vec3;

use crate::Result;
use crate::memory;
use cost::{cost, least_cost};
use links::Links;

/// Nodes are sorted by degree within windows of this many.
const WINDOW: usize = 512;

/// What an order must save to be taken.
const WORTH: f64 = 0.03;

/// `places[order[i]] = i`.
fn inverse(order: &[u32]) -> Result<Vec<u32>> {
    let mut places = memory::filled(0, order.len())?;
    for (place, &node) in (0..).zip(order) {
        places[node as usize] = place;
    }
    Ok(places)
}

/// Sorts by degree within windows, the most springs first.
fn by_degree(order: &[u32], links: &Links) -> Result<Vec<u32>> {
    let mut sorted = memory::copied(order)?;
    for window in sorted.chunks_mut(WINDOW) {
        window.sort_by_key(|&node| std::cmp::Reverse(links.degree(node)));
    }
    Ok(sorted)
}

#[cfg(test)]
mod trial {
    use super::*;
    use crate::mesh::Mesh;
    use std::time::Instant;

    pub fn shuffled(count: usize, mut seed: u64) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for i in (1..count).rev() {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            order.swap(i, ((seed >> 33) % (i as u64 + 1)) as usize);
        }
        order
    }

    fn mix(p: &[Vec3], s: &[[u32; 2]]) -> (Vec<Vec3>, Vec<[u32; 2]>) {
        let o = shuffled(p.len(), 7);
        let inv = inverse(&o).unwrap();
        (o.iter().map(|&n| p[n as usize]).collect(), s.iter().map(|x| x.map(|n| inv[n as usize])).collect())
    }

    pub fn grid(nx: u32, ny: u32, nz: u32) -> (Vec<Vec3>, Vec<[u32; 2]>) {
        let mut p = vec![];
        let mut s = vec![];
        for z in 0..nz { for y in 0..ny { for x in 0..nx {
            p.push(Vec3::new(x as f32, y as f32, z as f32) * 0.01);
            let own = x + nx * (y + ny * z);
            for d in 0..27 {
                let (dx, dy, dz) = (d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
                if d <= 13 { continue; }
                let (a, b, c) = (x as i32 + dx, y as i32 + dy, z as i32 + dz);
                if a >= 0 && b >= 0 && c >= 0 && a < nx as i32 && b < ny as i32 && c < nz as i32 {
                    s.push([own, a as u32 + nx * (b as u32 + ny * c as u32)]);
                }
            }
        }}}
        (p, s)
    }

    fn row(name: &str, p: &[Vec3], s: &[[u32; 2]]) {
        let t = Instant::now();
        let h = hilbert::along_curve(p).unwrap();
        let th = t.elapsed();
        let t = Instant::now();
        let names = inverse(&h).unwrap();
        let links = Links::new(p.len(), s, &names).unwrap();
        let ph: Vec<Vec3> = h.iter().map(|&n| p[n as usize]).collect();
        let tl = t.elapsed();
        let n = p.len() as f64;
        let id = names.clone();
        let hil: Vec<u32> = (0..p.len() as u32).collect();
        let t = Instant::now();
        let r = rows::rows(&ph, &links, false).unwrap();
        let tr = t.elapsed();
        let rs = rows::rows(&ph, &links, true).unwrap();
        let t = Instant::now();
        let cm = cuthill_mckee::reverse_cuthill_mckee(&links).unwrap();
        let tc = t.elapsed();
        let mut text = format!("{name} n {} s {} least {:.1} |", p.len(), s.len(), least_cost(&links) / n);
        let mut tcost = std::time::Duration::ZERO;
        for (what, o) in [("id", &id), ("hilbert", &hil), ("rows", &r), ("rows split", &rs), ("rcm", &cm)] {
            let t = Instant::now();
            let c = cost(o, &links).unwrap() / n;
            tcost = t.elapsed();
            text += &format!(" {what} {c:.1}");
            let d = by_degree(o, &links).unwrap();
            text += &format!("/{:.1}", cost(&d, &links).unwrap() / n);
        }
        eprintln!("{text}\n      hilbert {th:?} links {tl:?} rows {tr:?} rcm {tc:?} cost {tcost:?}");
    }

    #[test]
    #[ignore]
    fn table() {
        let (p, s) = grid(1000, 1000, 1);
        row("grid", &p, &s);
        let (pr, sr) = mix(&p, &s);
        row("grid mixed", &pr, &sr);
        // a bent, rolled sheet
        let bent: Vec<Vec3> = pr.iter().map(|q| { let a = q.x * 0.6 ; Vec3::new(a.cos() * (2.0 + 0.1 * a), q.y + 0.3 * (q.x * 3.0).sin(), a.sin() * (2.0 + 0.1 * a)) }).collect();
        row("rolled mixed", &bent, &sr);
        let rot: Vec<Vec3> = pr.iter().map(|q| glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7) * *q).collect();
        row("turned mixed", &rot, &sr);
        for n in [[12, 13, 14], [100, 100, 100], [10, 10, 10]] {
            let (p, s) = grid(n[0], n[1], n[2]);
            row("lattice", &p, &s);
            let (p, s) = mix(&p, &s);
            row("lattice mixed", &p, &s);
        }
        let mut meshes = vec![];
        for f in ["liver_volumetric.vtk", "gallbladder_volumetric.vtk", "stomach.msh", "tissue_volume.msh"] {
            meshes.push((f.to_string(), crate::mesh::load(format!("/work/shared/meshes/{f}"), crate::mesh::MeshFormat::Auto, 1.0).unwrap().mesh));
        }
        for k in [16.0, 40.0, 80.0, 120.0] {
            meshes.push((format!("organ {k}"), Mesh::organ(0.2, 0.2 / k).unwrap()));
        }
        meshes.push(("cloth".into(), Mesh::cloth([1.0, 1.0], [300, 200]).unwrap()));
        meshes.push(("block".into(), Mesh::block([1.0, 1.0, 1.0], [40, 50, 30]).unwrap()));
        for (name, mesh) in &meshes {
            let s = mesh.edges().unwrap();
            row(name, &mesh.positions, &s);
            let (p, s) = mix(&mesh.positions, &s);
            row(&format!("{name} mixed"), &p, &s);
        }
    }
}
