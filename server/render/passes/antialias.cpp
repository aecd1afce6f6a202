// Pixels of several surfaces, of captures and of the live picture while it rests (server/lighting/antialias.h).
#include "server/lighting/antialias.h"

#include "server/render/passes/passes.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// What edges depend on.
std::vector<std::uint64_t> edges_key(const PassContext& context) {
    return {context.scene.geometry_rev, context.scene.camera_rev, context.bodies_stand};
}

SlotRef edges_slot(const PassContext& context) {
    return {Slot::edges, context.target.id};
}

}  // namespace

bool finds_edges(const PassContext& context) {
    return context.samples_per_pixel > 1 && context.scene.technique == Technique::standard && !context.clusters.empty();
}

bool shows_edges(const PassContext& context) {
    if (!finds_edges(context)) return false;
    return context.target.kind != TargetKind::live || context.pass_cache.holds(edges_slot(context), edges_key(context));
}

bool filters_edges(const PassContext& context, View view) {
    return context.target.kind == TargetKind::live && view < View::illuminance && finds_edges(context) &&
           !shows_edges(context);
}

PassRun run_antialias(const PassContext& context, ScreenLight& screen) {
    lighting::GBuffer centres;
    lighting::Raster raster;
    lighting::look_through(context.eye, context.traced, context.geometry.near_m(), context.target.width_px,
                           context.target.height_px, centres);
    lighting::draw_gbuffer(context.clusters, context.material_table, context.target.emissive, centres, raster,
                           context.pool, {}, context.posed_bodies());
    const lighting::GBuffer& lit = screen.surfaces.gbuffer;  // GL's: two rasterisers differ at edges
    lighting::mark_others(lit, centres, raster, context.pool);
    lighting::EdgeSamples samples;
    while (!lighting::add_edge_sample(context.clusters, context.material_table, context.target.emissive, lit, raster,
                                      context.samples_per_pixel, samples, context.pool, context.posed_bodies())) {
    }
    screen.surfaces.edges = lighting::edges_of(context.samples_per_pixel, samples, context.pool);
    return {0, context.samples_per_pixel + 1};
}

bool edges_left(const PassContext& context) {
    return finds_edges(context) && context.quality_level == 0 && !shows_edges(context);
}

bool continue_antialias(const PassContext& context, ScreenLight& screen, const std::function<bool()>& interrupted) {
    const SlotRef at_work{Slot::edge_samples, context.target.id};
    if (!context.pass_cache.holds(at_work, edges_key(context))) {
        context.pass_cache.hold(at_work, edges_key(context));
        screen.edge_samples = {};
    }
    Surfaces& surfaces = screen.surfaces;
    while (!lighting::add_edge_sample(context.clusters, context.material_table, context.target.emissive,
                                      surfaces.gbuffer, surfaces.raster, context.samples_per_pixel, screen.edge_samples,
                                      context.pool, context.posed_bodies())) {
        if (interrupted()) return false;
    }
    surfaces.edges = lighting::edges_of(context.samples_per_pixel, screen.edge_samples, context.pool);
    context.pass_cache.hold(edges_slot(context), edges_key(context));
    return true;
}

}  // namespace gonio
