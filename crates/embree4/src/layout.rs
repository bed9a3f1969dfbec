//! Checks once per process that the loaded library writes hits where this crate expects them.
//!
//! Build options of Embree (instance arrays, levels of instancing) change the size of its hit structure without
//! changing its version. A ray that hits a triangle inside an instance, traced into a larger block, shows it.

use std::ptr;
use std::sync::OnceLock;

use embree4_sys as sys;

use crate::{Error, Ray, RayHit};

const CANARY: u32 = 0xC0FF_EE42;

#[repr(C, align(64))]
struct Probe {
    rayhit: RayHit,
    canaries: [u32; 64],
}

pub(crate) fn check(device: sys::RTCDevice) -> Result<(), Error> {
    static RESULT: OnceLock<Result<(), Error>> = OnceLock::new();
    RESULT.get_or_init(|| probe(device)).clone()
}

fn probe(device: sys::RTCDevice) -> Result<(), Error> {
    let vertices = [[0.0_f32, 0.0, 1.0, 0.0], [4.0, 0.0, 1.0, 0.0], [0.0, 4.0, 1.0, 0.0]];
    let indices = [0_u32, 1, 2, 0];
    let mut probe =
        Probe { rayhit: RayHit::new(Ray::new([1.0, 1.0, 0.0], [0.0, 0.0, 1.0])), canaries: [CANARY; 64] };
    probe.rayhit.hit.inst_prim_id = [CANARY];
    use sys::{RTCBufferType as B, RTCFormat as F, RTCGeometryType as G};
    // SAFETY: plain use of the C interface as documented; the arrays outlive the scenes, are padded to 16 bytes
    // past the start of their last element, and all objects are released here. The probe leaves 256 bytes behind
    // the structure for a library that writes more than expected.
    let error = unsafe {
        let array = sys::rtcNewGeometry(device, G::RTC_GEOMETRY_TYPE_INSTANCE_ARRAY);
        crate::device::check(device).map_err(|_| different("it has no instance arrays"))?;
        sys::rtcReleaseGeometry(array);

        let mesh = sys::rtcNewGeometry(device, G::RTC_GEOMETRY_TYPE_TRIANGLE);
        let (v, i) = (vertices.as_ptr().cast(), indices.as_ptr().cast());
        sys::rtcSetSharedGeometryBuffer(
            mesh,
            B::RTC_BUFFER_TYPE_VERTEX,
            0,
            F::RTC_FORMAT_FLOAT3,
            v,
            0,
            16,
            3,
        );
        sys::rtcSetSharedGeometryBuffer(mesh, B::RTC_BUFFER_TYPE_INDEX, 0, F::RTC_FORMAT_UINT3, i, 0, 12, 1);
        sys::rtcCommitGeometry(mesh);
        let inner = sys::rtcNewScene(device);
        sys::rtcAttachGeometry(inner, mesh);
        sys::rtcReleaseGeometry(mesh);
        sys::rtcCommitScene(inner);

        let instance = sys::rtcNewGeometry(device, G::RTC_GEOMETRY_TYPE_INSTANCE);
        sys::rtcSetGeometryInstancedScene(instance, inner);
        sys::rtcCommitGeometry(instance);
        let outer = sys::rtcNewScene(device);
        sys::rtcAttachGeometryByID(outer, instance, 5);
        sys::rtcReleaseGeometry(instance);
        sys::rtcCommitScene(outer);

        let error = crate::device::check(device);
        sys::rtcIntersect1(outer, (&raw mut probe).cast(), ptr::null_mut());
        sys::rtcReleaseScene(outer);
        sys::rtcReleaseScene(inner);
        error
    };
    error?;
    let hit = probe.rayhit.hit;
    if probe.canaries != [CANARY; 64] {
        return Err(different("it writes past the end of a ray and its hit"));
    }
    let found = (probe.rayhit.ray.tfar - 1.0).abs() < 1e-3;
    let ids = (hit.prim_id, hit.geom_id, hit.inst_id, hit.inst_prim_id);
    if !found || ids != (0, 0, [5], [0]) {
        return Err(different("ids are not where they belong"));
    }
    Ok(())
}

fn different(reason: &str) -> Error {
    Error::UnsupportedLayout { reason: reason.into() }
}
