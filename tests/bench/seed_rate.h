// What the seed technique's inner loop should cost on this machine: a shader of the same arithmetic and the same random
// fetches from cube maps of the same formats and sizes, without scene, G-buffer or renderer around it. Render thread.
#pragma once

#include "server/gl/objects.h"

namespace gonio::bench {

class SeedRate {
public:
    // rsm_size: texels per face side of the position, normal and flux maps; mask_size likewise of the mask, whose mip
    // level of the RSM's size is read, as the technique does. Throws std::runtime_error if the shader does not compile.
    SeedRate(int rsm_size, int mask_size);

    // Result: ns per pixel and sample over a picture of this size with this many samples, everything included.
    double ns_per_sample(int width_px, int height_px, unsigned samples);

private:
    gl::Program program_;
    gl::Texture position_, normal_, flux_, mask_;
    gl::Sampler nearest_level_;
    gl::Buffer directions_;
    gl::VertexArray screen_;
    float mask_lod_ = 0.0f;
    bool compiled_ = false;  // GL drivers compile at the first draw
};

}  // namespace gonio::bench
