// Uniform locations and texture units of passes/composite.frag, for both sides. The work light includes
// lib/surface.glsl, which has the locations 8 to 11 and the units 8 and 9.
#ifdef __cplusplus
#pragma once
namespace gonio::layouts {
#endif

const int kAtLightCount = 1, kAtEv100 = 2, kAtGain = 3, kAtCubeScale = 4, kAtBesidesUnit = 5, kAtIndirectInLayers = 6,
          kAtWhite = 7, kAtWorkLight = 12, kAtAirUnit = 13, kAtOpenings = 14;
const int kUnitDirect = 0, kUnitIndirect = 1, kUnitAlbedo = 2, kUnitEmissive = 3, kUnitCube = 4, kUnitBesides = 5,
          kUnitAir = 6, kUnitDepth = 8, kUnitOpenings = 10;

#ifdef __cplusplus
}  // namespace gonio::layouts
#endif
