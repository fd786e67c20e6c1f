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

/// Rays of a packet.
const WIDE: usize = 16;

/// `RTCRayHit16` with room for the instance ids of any configuration.
#[repr(C, align(64))]
struct RayHit16 {
    o: [[f32; WIDE]; 3],
    near: [f32; WIDE],
    d: [[f32; WIDE]; 3],
    time: [f32; WIDE],
    far: [f32; WIDE],
    mask: [u32; WIDE],
    id: [u32; WIDE],
    flags: [u32; WIDE],
    normal: [[f32; WIDE]; 3],
    uv: [[f32; WIDE]; 2],
    primitive: [u32; WIDE],
    geometry: [u32; WIDE],
    instance: [[u32; WIDE]; 9],
}

impl RayHit16 {
    /// All numbers that the library reads before it writes them.
    fn new() -> Self {
        let (zero, none) = ([0.0; WIDE], [u32::MAX; WIDE]);
        Self {
            o: [zero; 3],
            near: zero,
            d: [zero; 3],
            time: zero,
            far: zero,
            mask: none,
            id: [0; WIDE],
            flags: [0; WIDE],
            normal: [zero; 3],
            uv: [zero; 2],
            primitive: none,
            geometry: none,
            instance: [none; 9],
        }
    }

    fn fill(&mut self, rays: &[Ray]) {
        for (i, r) in rays.iter().enumerate() {
            let (o, d) = (r.origin.0, r.dir.0);
            (self.o[0][i], self.o[1][i], self.o[2][i]) = (o.x, o.y, o.z);
            (self.d[0][i], self.d[1][i], self.d[2][i]) = (d.x, d.y, d.z);
            self.far[i] = r.t_max;
        }
        self.geometry = [u32::MAX; WIDE];
    }
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`.
#[repr(C)]
struct Arguments {
    flags: c_int,
    features: u32,
    context: *mut c_void,
    filter: *mut c_void,
    intersect: *mut c_void,
    width: f32,
}

type Trace16 = unsafe extern "C" fn(*const [c_int; WIDE], Handle, *mut RayHit16, *mut Arguments);

/// A scene of one library.
#[derive(Clone)]
pub(crate) struct Embree {
    name: &'static str,
    scene: Handle,
    intersect: Trace,
    occluded: Trace,
    /// What its build took.
    pub(crate) seconds: f64,
    intersect16: Trace16,
    occluded16: Trace16,
}

/// The same scene by packets of sixteen rays, with the flag for coherent rays or without.
pub(crate) struct Embree16 {
    name: String,
    scene: Embree,
    flags: c_int,
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
            let intersect16 = function!("rtcIntersect16", Trace16);
            let occluded16 = function!("rtcOccluded16", Trace16);
            Self { name, scene, intersect, occluded, intersect16, occluded16, seconds }
        }
    }

    /// By packets.
    pub(crate) fn packets(&self, is_coherent: bool) -> Embree16 {
        let name = format!("{} 16 {}", self.name, if is_coherent { "coherent" } else { "incoherent" });
        Embree16 { name, scene: self.clone(), flags: c_int::from(is_coherent) << 16 }
    }
}

impl Embree16 {
    /// Fills and traces one packet after the other, and adds up what the last function says of each.
    fn each(&self, trace: Trace16, rays: &[Ray], count: impl Fn(&RayHit16) -> [bool; WIDE]) -> usize {
        let null = std::ptr::null_mut();
        let mut arguments = Arguments {
            flags: self.flags,
            features: u32::MAX,
            context: null,
            filter: null,
            intersect: null,
            width: 0.0,
        };
        let mut packet = RayHit16::new();
        let mut all = 0;
        for rays in rays.chunks(WIDE) {
            let mut valid = Valid([0; WIDE]);
            valid.0[..rays.len()].fill(-1);
            packet.fill(rays);
            // SAFETY: the scene is committed, and packet, arguments and lanes are laid out and aligned as the library expects.
            unsafe { trace(&raw const valid.0, self.scene.scene, &raw mut packet, &raw mut arguments) };
            let hit = count(std::hint::black_box(&packet));
            all += hit.iter().take(rays.len()).filter(|h| **h).count();
        }
        all
    }
}

#[repr(C, align(64))]
struct Valid([c_int; WIDE]);

impl Tracer for Embree16 {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn nearest(&mut self, rays: &[Ray]) -> usize {
        self.each(self.scene.intersect16, rays, |p| p.geometry.map(|g| g != u32::MAX))
    }

    fn any(&mut self, rays: &[Ray]) -> usize {
        self.each(self.scene.occluded16, rays, |p| p.far.map(|t| t < 0.0))
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
