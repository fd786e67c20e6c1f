//! Embree 4, loaded from its shared library at run time (for example that of the wheel `embreex`).
#![allow(unsafe_code, reason = "a foreign library; see each SAFETY note")]

use std::ffi::{CString, c_char, c_int, c_void};

use math::Ray;

use crate::Tracer;
use crate::ply::Mesh;

unsafe extern "C" {
    fn dlopen(name: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

type Handle = *mut c_void;

/// `RTCRayHit` with room for the instance ids of any configuration.
#[repr(C, align(64))]
struct RayHit {
    o: [f32; 3],
    near: f32,
    d: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: [u32; 9],
}

impl RayHit {
    fn new(r: &Ray) -> Self {
        let (o, d) = (r.origin.0.to_array(), r.dir.0.to_array());
        let none = u32::MAX;
        Self {
            o,
            near: 0.0,
            d,
            time: 0.0,
            far: r.t_max,
            mask: none,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            uv: [0.0; 2],
            primitive: none,
            geometry: none,
            instance: [none; 9],
        }
    }
}

type Trace = unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void);

/// A scene of one library.
pub(crate) struct Embree {
    name: &'static str,
    scene: Handle,
    intersect: Trace,
    occluded: Trace,
    /// What its build took.
    pub(crate) seconds: f64,
}

impl Embree {
    pub(crate) fn new(path: &str, name: &'static str, flags: c_int, meshes: &[Mesh], threads: usize) -> Self {
        const TRIANGLES: c_int = 0;
        let (indices, vertices, uint3, float3) = (0, 1, 0x5003, 0x9003);
        // SAFETY: the signatures are those of Embree 4's C interface; the buffers are filled to the size asked for
        // before the commit reads them.
        unsafe {
            let library = dlopen(CString::new(path).expect("a path").as_ptr(), 2);
            assert!(!library.is_null(), "{path} is no library");
            macro_rules! function {
                ($name:literal, $t:ty) => {{
                    let f = dlsym(library, concat!($name, "\0").as_ptr().cast());
                    assert!(!f.is_null(), $name);
                    std::mem::transmute_copy::<*mut c_void, $t>(&f)
                }};
            }
            let device = function!("rtcNewDevice", unsafe extern "C" fn(*const c_char) -> Handle)(
                CString::new(format!("threads={threads}")).expect("a number").as_ptr(),
            );
            let scene = function!("rtcNewScene", unsafe extern "C" fn(Handle) -> Handle)(device);
            function!("rtcSetSceneFlags", unsafe extern "C" fn(Handle, c_int))(scene, flags);
            let new_geometry = function!("rtcNewGeometry", unsafe extern "C" fn(Handle, c_int) -> Handle);
            type NewBuffer = unsafe extern "C" fn(Handle, c_int, u32, c_int, usize, usize) -> *mut c_void;
            let new_buffer = function!("rtcSetNewGeometryBuffer", NewBuffer);
            let commit = function!("rtcCommitGeometry", unsafe extern "C" fn(Handle));
            let attach = function!("rtcAttachGeometry", unsafe extern "C" fn(Handle, Handle) -> u32);
            for mesh in meshes {
                let g = new_geometry(device, TRIANGLES);
                let v: *mut [f32; 3] = new_buffer(g, vertices, 0, float3, 12, mesh.positions.len()).cast();
                mesh.positions.iter().enumerate().for_each(|(i, p)| v.add(i).write(p.to_array()));
                let f: *mut [u32; 3] = new_buffer(g, indices, 0, uint3, 12, mesh.indices.len()).cast();
                mesh.indices.iter().enumerate().for_each(|(i, t)| f.add(i).write(*t));
                commit(g);
                attach(scene, g);
            }
            let start = std::time::Instant::now();
            function!("rtcCommitScene", unsafe extern "C" fn(Handle))(scene);
            let seconds = start.elapsed().as_secs_f64();
            let (intersect, occluded) = (function!("rtcIntersect1", Trace), function!("rtcOccluded1", Trace));
            Self { name, scene, intersect, occluded, seconds }
        }
    }
}

impl Tracer for Embree {
    fn name(&self) -> String {
        self.name.to_owned()
    }

    fn nearest(&mut self, rays: &[Ray]) -> usize {
        let hit = |r: &&Ray| {
            let mut h = RayHit::new(r);
            // SAFETY: the scene is committed and `h` is laid out as the library expects.
            unsafe { (self.intersect)(self.scene, &mut h, std::ptr::null_mut()) };
            std::hint::black_box(h.geometry) != u32::MAX
        };
        rays.iter().filter(hit).count()
    }

    fn any(&mut self, rays: &[Ray]) -> usize {
        let blocked = |r: &&Ray| {
            let mut h = RayHit::new(r);
            // SAFETY: as above; only the ray at the front is read and written.
            unsafe { (self.occluded)(self.scene, &mut h, std::ptr::null_mut()) };
            h.far < 0.0
        };
        rays.iter().filter(blocked).count()
    }
}
