//! Bullet: deformable bodies, explicit and implicit, and the older soft bodies of links.

use std::path::Path;

use super::{Engine, Line};
use crate::contender::compile_bullet;
use crate::precision::law::Law;
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "Bullet",
        color: "#5a8f29",
        program: || {
            let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("players/bullet.cpp");
            compile_bullet(&source, "bullet_player").map(|program| vec![program])
        },
        lines: |scene| Ok(lines(scene)),
        notes: "As Debian builds it. Deformable: neo-Hookean tetrahedra or mass-spring forces without damping, explicit or implicit \
                Euler, the latter by conjugate gradients (`setUseProjection`), as its default solver does not move nodes. Links: position constraints whose iterations together move a single spring like an implicit step of \
                the same stiffness.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    let newton = ["kind=implicit", "iterations=10"];
    if scene.model.has(Law::Springs) {
        return vec![
            Line::doubling(
                "links, 4 iterations",
                Law::Springs,
                &["kind=links", "iterations=4"],
                1,
                4096,
            ),
            Line::doubling(
                "links, 32 iterations",
                Law::Springs,
                &["kind=links", "iterations=32"],
                1,
                4096,
            ),
            Line::doubling("deformable, explicit", Law::Springs, &["kind=explicit"], 8, 4096),
            Line::doubling("deformable, implicit", Law::Springs, &["kind=implicit"], 1, 4096),
            Line::doubling(
                "deformable, implicit, 10 Newton iterations",
                Law::Springs,
                &newton,
                1,
                4096,
            ),
        ];
    }
    vec![
        Line::doubling("deformable, explicit", Law::NeoHookean, &["kind=explicit"], 32, 4096),
        Line::doubling("deformable, implicit", Law::NeoHookean, &["kind=implicit"], 1, 4096),
        Line::doubling(
            "deformable, implicit, 10 Newton iterations",
            Law::NeoHookean,
            &newton,
            1,
            4096,
        ),
    ]
}
