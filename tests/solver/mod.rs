//! How bodies move: VERLET, IMPLICIT, NEWTON, states of rest, storages, threads.

mod auto;
mod budget;
mod implicit;
mod implicit_motion;
mod implicit_press;
mod implicit_spheres;
mod implicit_statics;
mod implicit_tools;
mod limits;
mod mass_scaling;
mod newton;
mod organ;
mod pin_axes;
mod rest_state;
mod rigid_motion;
mod settings;
mod storages;
mod threads;
mod tolerance;
mod verlet_accuracy;
mod verlet_conservation;
mod verlet_open_steps;
mod verlet_pipeline;
mod verlet_stability;
mod verlet_statics;
mod verlet_step;
