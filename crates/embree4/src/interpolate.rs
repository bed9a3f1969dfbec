//! Values at points of a surface, and their derivatives.

use std::ptr;

use embree4_sys as sys;

use crate::geometry::Slot;
use crate::{Error, GeometryId, Scene};

/// Which values to interpolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexData {
    /// Positions (and radii of curves) at this time step.
    Position(u32),
    /// The vertex attribute in this slot.
    Attribute(u32),
}

/// A value on a surface and how it changes with the surface coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Interpolated<const N: usize> {
    pub value: [f32; N],
    pub du: [f32; N],
    pub dv: [f32; N],
    pub dudu: [f32; N],
    pub dvdv: [f32; N],
    pub dudv: [f32; N],
}

/// Room for four numbers; Embree writes whole vectors of four on old processors.
type Room = [f32; 8];

impl Scene {
    /// The first `N` components of vertex data at coordinates (u, v) of a primitive, as in a hit.
    ///
    /// On curves and subdivision surfaces the coordinates are moved into 0 to 1.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`]; [`Error::IndexOutOfRange`] for the primitive; [`Error::Unsupported`] if the
    /// geometry has no such data, fewer components than `N`, or is a point, instance or user geometry.
    ///
    /// ```
    /// use embree4::{Device, SceneBuilder, TriangleMesh, VertexData};
    /// let mut builder = SceneBuilder::new(&Device::new()?)?;
    /// let corners = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    /// let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]]).vertex_attribute(0, vec![1.0, 3.0, 5.0]);
    /// let id = builder.attach(mesh)?;
    /// let scene = builder.commit()?;
    /// assert_eq!(scene.interpolate(id, 0, 0.5, 0.25, VertexData::Position(0))?, [1.0, 0.5, 0.0]);
    /// assert_eq!(scene.interpolate(id, 0, 0.5, 0.25, VertexData::Attribute(0))?, [3.0]);
    /// # Ok::<(), embree4::Error>(())
    /// ```
    pub fn interpolate<const N: usize>(
        &self,
        geometry: GeometryId,
        prim_id: u32,
        u: f32,
        v: f32,
        data: VertexData,
    ) -> Result<[f32; N], Error> {
        let mut args = self.arguments(geometry, prim_id, u, v, data, N)?;
        let mut value: Room = [0.0; 8];
        args.P = value.as_mut_ptr();
        // SAFETY: `arguments` checked everything; at most four floats are written to a room of eight.
        unsafe { sys::rtcInterpolate(&raw const args) };
        self.device().check()?;
        Ok(first(&value))
    }

    /// [`interpolate`](Self::interpolate) with first and second derivatives.
    ///
    /// # Errors
    /// As [`interpolate`](Self::interpolate).
    pub fn interpolate_derivatives<const N: usize>(
        &self,
        geometry: GeometryId,
        prim_id: u32,
        u: f32,
        v: f32,
        data: VertexData,
    ) -> Result<Interpolated<N>, Error> {
        let mut args = self.arguments(geometry, prim_id, u, v, data, N)?;
        let mut rooms: [Room; 6] = [[0.0; 8]; 6];
        let [value, du, dv, dudu, dvdv, dudv] = &mut rooms;
        args.P = value.as_mut_ptr();
        args.dPdu = du.as_mut_ptr();
        args.dPdv = dv.as_mut_ptr();
        args.ddPdudu = dudu.as_mut_ptr();
        args.ddPdvdv = dvdv.as_mut_ptr();
        args.ddPdudv = dudv.as_mut_ptr();
        // SAFETY: as above, for six rooms.
        unsafe { sys::rtcInterpolate(&raw const args) };
        self.device().check()?;
        let [value, du, dv, dudu, dvdv, dudv] = &rooms;
        Ok(Interpolated {
            value: first(value),
            du: first(du),
            dv: first(dv),
            dudu: first(dudu),
            dvdv: first(dvdv),
            dudv: first(dudv),
        })
    }

    fn arguments(
        &self,
        id: GeometryId,
        prim_id: u32,
        u: f32,
        v: f32,
        data: VertexData,
        components: usize,
    ) -> Result<sys::RTCInterpolateArguments, Error> {
        use sys::RTCGeometryType as G;
        let geometry = self.inner().geometry(id)?;
        let limit = geometry.primitives as usize;
        if prim_id >= geometry.primitives {
            return Err(Error::IndexOutOfRange { what: "primitive", position: 0, index: prim_id, limit });
        }
        let (u, v) = match geometry.kind {
            G::RTC_GEOMETRY_TYPE_TRIANGLE | G::RTC_GEOMETRY_TYPE_QUAD => (u, v),
            _ if geometry.interpolates => (within(u), within(v)),
            _ => return Err(Error::Unsupported("this kind of geometry does not interpolate")),
        };
        let slot = match data {
            VertexData::Position(step) => Slot::vertex(step),
            VertexData::Attribute(slot) => Slot::attribute(slot),
        };
        match geometry.buffers.get(&slot) {
            Some(buffer) if (1..=buffer.floats.min(4)).contains(&components) => {}
            _ => {
                return Err(Error::Unsupported("the geometry has no such data, or not that many components"));
            }
        }
        Ok(sys::RTCInterpolateArguments {
            geometry: geometry.raw(),
            primID: prim_id,
            u,
            v,
            bufferType: sys::RTCBufferType(slot.0),
            bufferSlot: slot.1,
            P: ptr::null_mut(),
            dPdu: ptr::null_mut(),
            dPdv: ptr::null_mut(),
            ddPdudu: ptr::null_mut(),
            ddPdvdv: ptr::null_mut(),
            ddPdudv: ptr::null_mut(),
            valueCount: components as u32,
        })
    }
}

/// Moves a coordinate into 0 to 1; NaN becomes 0.
fn within(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) }
}

fn first<const N: usize>(room: &Room) -> [f32; N] {
    std::array::from_fn(|i| room[i])
}
