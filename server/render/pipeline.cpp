#include "server/render/pipeline.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "server/scene/false_color.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

bool shows_direct(View view) {
    return view < View::mask && view != View::indirect;
}
bool shows_indirect(View view) {
    return view < View::mask && view != View::direct;
}

std::size_t shown_light(const Scene& scene) {
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        if (scene.lights[i].name == scene.view_light) return i;
    }
    return 0;
}

std::uint64_t bits(double value) {
    return std::bit_cast<std::uint64_t>(value);
}

struct Builder {
    const FrameInputs& in;
    std::vector<Pass> passes;
    const Scene& scene = in.scene;
    const std::uint32_t target = in.target.id;
    const bool seed = in.scene.technique != Technique::standard;
    const bool on_cpu = in.shades_on_cpu(), by_gl = in.gathers_by_gl();
    const bool shown_on_cpu = on_cpu && in.view <= View::indirect;
    const bool metered = in.meter != FrameInputs::Meter::none;
    const PassContext context = in.context();

    std::string of_light;  // name; of the passes that are added

    SlotRef per_target(Slot slot, std::uint32_t light = 0) const { return {slot, target, light}; }
    static SlotRef per_light(Slot slot, std::uint32_t light) { return {slot, 0, light}; }

    Pass& add(std::string name, SlotRef writes, std::vector<SlotRef> reads, std::vector<std::uint64_t> key,
              std::function<PassRun()> run) {
        Pass& pass = passes.emplace_back();
        pass.name = std::move(name);
        pass.light = of_light;
        pass.writes = writes;
        pass.reads = std::move(reads);
        pass.key = std::move(key);
        pass.stale = seed;  // the seed technique recomputes everything in each frame, as its paper does
        pass.run = std::move(run);
        return pass;
    }
    Pass& add_cpu(std::string name, SlotRef writes, std::vector<SlotRef> reads, std::vector<std::uint64_t> key,
                  std::function<PassRun()> run) {
        Pass& pass = add(std::move(name), writes, std::move(reads), std::move(key), std::move(run));
        pass.on_gpu = false;
        return pass;
    }

    // Captures gather at their pixels at once; the live picture while it rests.
    bool gathers_at_once() const { return in.target.kind != TargetKind::live && !seed; }
    // What the picture shows that is in no layer.
    std::vector<SlotRef> besides() const {
        std::vector<SlotRef> slots;
        if (!shows_lit_surfaces(in.view) || !in.has_besides()) return slots;
        if (by_gl && in.merged && shows_indirect(in.view)) slots.push_back(per_target(Slot::merged_solve));
        if (emits()) slots.insert(slots.end(), {per_target(Slot::emitted), per_target(Slot::refined)});
        if (in.layered() == scene.lights.size()) return slots;
        if (in.view != View::indirect) slots.push_back(per_target(Slot::direct, kSummed));
        if (in.view != View::direct)
            slots.insert(slots.end(), {per_target(Slot::gather, kSummed), per_target(Slot::refined, kSummed)});
        return slots;
    }
    bool emits() const { return in.geometry.emissive() && !seed && !scene.emission_hidden; }
    // Whether it stands as it did in the frame before.
    bool rests(const Light& light) const {
        return std::max({light.position_rev, light.aim_rev, light.profile_rev}) <= in.seen_rev;
    }

    // Whether it is solved in this frame although nothing it depends on is new. Solving to the end takes as long as a
    // frame: in the live picture one luminaire a frame.
    bool solves_now(const Light& light, const transport::Irradiance& solved) {
        if (solved.converged) return false;
        if (in.target.kind != TargetKind::live || solved.frames_left > 0 || !rests(light)) return true;
        return !std::exchange(solves_one_, true);
    }
    bool solves_one_ = false;

    PassContext context_of(const Light& light) const {  // by value: passes outlive the builder
        PassContext own = context;
        own.rests = rests(light);
        return own;
    }

    void add_light(std::size_t i) {
        of_light = scene.lights[i].name;
        if (in.layers[i] >= 0 || (i == shown_light(scene) && in.view >= View::mask)) add_maps(i);
        const Light& light = scene.lights[i];
        add_cpu(
            "surfels", per_light(Slot::surfels, light.id), {},
            {light.position_rev, light.aim_rev, light.profile_rev, scene.geometry_rev, scene.haze_rev, in.surface()},
            [shared = context_of(light), &light, &gpu = *in.lights[i]] { return run_surfels(shared, light, gpu); })
            .absent = seed;
        if (context.haze) add_haze(i);
        if (in.layers[i] >= 0) add_layer(i, in.layers[i]);
        of_light.clear();
    }

    // Where haze's light onto surfaces is found, of all luminaires.
    void add_haze_points() {
        add_cpu("haze-points", {Slot::haze_points}, {}, {in.surface()},
                [context = context] { return run_haze_points(context, *context.haze_points); });
    }

    // Of a luminaire in haze: how far its light goes, and what the air scatters of it and of its bounces.
    void add_haze(std::size_t i) {
        const Light& light = scene.lights[i];
        LightGpu& gpu = *in.lights[i];
        const PassContext shared = context_of(light);
        const SlotRef distances = per_light(Slot::distances, light.id);
        add_cpu("haze-distances", distances, {},
                {light.position_rev, light.aim_rev, light.profile_rev, scene.geometry_rev},
                [=, &light, &gpu] { return run_distances(shared, light, gpu); });
        add_cpu("haze-surfels", per_light(Slot::haze_surfels, light.id), {distances, {Slot::haze_points}},
                {scene.haze_rev}, [=, &light, &gpu] { return run_haze_surfels(shared, light, gpu); });
    }

    // What haze shows to the eye: of luminaires kept apart, of all at once, of the others, and of emissive surfaces.
    void add_air() {
        ScreenLight& screen = in.screen;
        ScreenAir& air = screen.air;
        const SlotRef probes{Slot::probes}, view = per_target(Slot::air_view), seen = per_target(Slot::seen_probes);
        const lighting::AirBox box = air_box_of(context);
        std::vector<std::uint64_t> filled = {in.surface()};
        for (int k = 0; k < 3; ++k)
            filled.insert(filled.end(),
                          {std::bit_cast<std::uint32_t>(box.low[k]), std::bit_cast<std::uint32_t>(box.high[k])});
        add_cpu("haze-probes", probes, {}, std::move(filled),
                [context = context] { return run_probes(context, *context.probes); });
        add_cpu("haze-rays", view, {per_target(Slot::grid)}, {},
                [context = context, &screen] { return run_air_view(context, screen.surfaces, screen.air.view); });
        add_cpu("haze-seen", seen, {per_target(Slot::grid), probes}, {},
                [context = context, &air] { return run_seen_probes(context, air.seen_probes); });
        const auto add_glow = [&](std::string name, std::uint32_t id, SlotRef solved,
                                  const transport::Irradiance& light, lighting::Glow& out) {
            add_cpu(std::move(name), per_target(Slot::glow, id), {solved, probes, seen}, {scene.haze_rev},
                    [context = context, &light, &out, emission = id == kEmitted] {
                        return run_glow(context, *context.probes, light, emission, out);
                    });
        };
        air.beams.resize(kMostLayers), air.glow.resize(kMostLayers);
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            if (in.layers[i] < 0) continue;
            const Light& light = scene.lights[i];
            const auto layer = static_cast<std::size_t>(in.layers[i]);
            of_light = light.name;
            add_cpu("haze-airlight", per_target(Slot::airlight, light.id), {per_light(Slot::distances, light.id), view},
                    {scene.haze_rev, layer},
                    [context = context, &light, &gpu = *in.lights[i], &screen = screen, &air, layer] {
                        return run_airlight(context, light, gpu, screen.surfaces, air.view, air.beams[layer]);
                    });
            add_glow("haze-glow", light.id, per_light(Slot::solve, light.id), in.lights[i]->irradiance,
                     air.glow[layer]);
            passes.back().key.push_back(layer);
        }
        of_light.clear();
        if (in.can_merge())
            add_glow("haze-glow", 0, per_target(Slot::merged_solve), screen.light.merged.irradiance, air.merged_glow);
        if (in.layered() < scene.lights.size()) {
            const SlotRef solved = in.shares_sum ? per_light(Slot::merged_solve, kSummed)
                                                 : per_target(Slot::merged_solve, kSummed),
                          merged = in.shares_sum ? per_light(Slot::merged, kSummed) : per_target(Slot::merged, kSummed);
            std::vector<SlotRef> reads = {view, merged};
            for (const Light& light : scene.lights) reads.push_back(per_light(Slot::distances, light.id));
            add_cpu("summed-haze-airlight", per_target(Slot::airlight, kSummed), std::move(reads), {scene.haze_rev},
                    [context = context, lights = std::vector<const LightGpu*>(in.lights.begin(), in.lights.end()),
                     &screen = screen, &air] { return run_airlight_summed(context, lights, screen.surfaces, air); });
            add_glow("summed-haze-glow", kSummed, solved, screen.light.summed_list.irradiance, air.summed_glow);
        }
        if (emits() && in.transport != nullptr) {
            add_glow("haze-glow", kEmitted, per_target(Slot::emitted), in.transport->emitted, air.emitted_glow);
            passes.back().key.push_back(in.generation);
        }
    }
    // The slots of it that a view shows.
    std::vector<SlotRef> air_slots() const {
        std::vector<SlotRef> slots;
        if (!context.haze || metered || !shows_air(in.view)) return slots;
        slots.push_back(per_target(Slot::air_view));
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            if (in.layers[i] < 0) continue;
            slots.push_back(per_target(Slot::airlight, scene.lights[i].id));
            if (!in.merged) slots.push_back(per_target(Slot::glow, scene.lights[i].id));
        }
        if (in.merged) slots.push_back(per_target(Slot::glow));
        if (in.layered() < scene.lights.size())
            slots.insert(slots.end(), {per_target(Slot::airlight, kSummed), per_target(Slot::glow, kSummed)});
        if (emits() && in.transport != nullptr) slots.push_back(per_target(Slot::glow, kEmitted));
        return slots;
    }

    void add_maps(std::size_t i) {
        const Light& light = scene.lights[i];
        LightGpu& gpu = *in.lights[i];
        const PassContext shared = context_of(light);
        const SlotRef rsm = per_light(Slot::rsm, light.id), mask = per_light(Slot::mask, light.id);
        const auto faces = [&](const LightGpu::Faces& made) {
            return seed ? gpu.reached : missing_faces(made, gpu.reached, light.position_rev, scene.geometry_rev);
        };
        const unsigned shadow_faces = faces(gpu.shadow_faces), rsm_faces = faces(gpu.rsm_faces);
        Pass& shadow_pass = add(
            "shadow", per_light(Slot::shadow, light.id), {},
            {light.position_rev, scene.geometry_rev, static_cast<std::uint64_t>(shadow_size_of(scene.lights.size()))},
            [=, &light, &gpu] { return run_shadow(shared, light, gpu, shadow_faces); });
        shadow_pass.stale |= shadow_faces != 0;
        Pass& rsm_pass = add("rsm", rsm, {}, {light.position_rev, scene.geometry_rev},
                             [=, &light, &gpu] { return run_rsm(shared, light, gpu, rsm_faces); });
        rsm_pass.stale |= rsm_faces != 0;
        add("mask", mask, {}, {light.profile_rev, light.aim_rev},
            [=, &light, &gpu] { return run_mask(shared, light, gpu); });
        add("rsm-flux", per_light(Slot::flux, light.id), {rsm, mask}, {}, [=, &gpu] { return run_flux(shared, gpu); });
    }

    void add_layer(std::size_t i, int layer) {
        const Light& light = scene.lights[i];
        LightGpu& gpu = *in.lights[i];
        ScreenLight& screen = in.screen;
        PassContext shared = context_of(light);
        const auto index = static_cast<std::uint64_t>(layer);
        const SlotRef gbuffer = per_target(Slot::gbuffer), solved = per_light(Slot::solve, light.id),
                      gathered = per_target(Slot::gather, light.id), lit = per_target(Slot::direct, light.id);
        std::vector<SlotRef> lit_surfels = {per_light(Slot::surfels, light.id)};
        if (context.haze) lit_surfels.push_back(per_light(Slot::haze_surfels, light.id));
        Pass& solve = add_cpu("solve", solved, std::move(lit_surfels),
                              {in.generation, in.solve_links(), gpu.has_exact() ? 1u : 0u}, [=, &gpu, &screen] {
                                  const PassRun run = run_solve(shared, gpu, screen.weights);
                                  screen.solved = gpu.irradiance.solved;
                                  return run;
                              });
        solve.absent = seed;
        solve.stale |= solves_now(light, gpu.irradiance);
        // A cube of depths has steps, and holds no parallel light of a sun nor the shadows of an opening: it is for
        // points that move.
        const bool rests_for_rays = in.target.kind != TargetKind::live || in.wants_each_pixel(light);
        const bool soft = has_opening(light);
        const bool rays = (in.direct_by_rays || light.sun || soft || rests_for_rays) && !seed;
        shared.each_pixel = rays && ((by_gl && !soft) || rests_for_rays);
        Pass& direct = add("direct", lit, {rays && !metered ? per_target(Slot::grid) : gbuffer},
                           {light.position_rev, light.aim_rev, light.profile_rev, scene.geometry_rev, scene.haze_rev,
                            index, shared.each_pixel ? shared.samples_per_pixel : 0u},
                           [=, metered = metered, &light, &gpu, &screen] {
                               if (!rays) return run_direct(shared, light, gpu, layer);
                               if (metered) return run_direct_point(shared, light, gpu, layer, screen.meter);
                               return run_direct_rays(shared, light, gpu, layer, screen.surfaces, screen.light.layers);
                           });
        direct.on_gpu = !rays;
        if (shared.each_pixel && finds_edges(context) && shows_lit_surfaces(in.view))
            direct.reads.push_back(per_target(Slot::edges));
        if (!rays) direct.reads.push_back(per_light(Slot::shadow, light.id));
        if (seed) {
            add("gather", gathered, {gbuffer, per_light(Slot::rsm, light.id), per_light(Slot::mask, light.id)},
                {scene.samples, index}, [=, &light, &gpu] { return run_gather_seed(shared, light, gpu, layer); });
        } else if (metered) {
            add_cpu("gather", gathered, {gbuffer, solved}, {light.position_rev},
                    [=, &light, &gpu, &screen] { return run_gather_point(shared, light, gpu, layer, screen.meter); });
        } else if (by_gl) {
            add("gather", gathered, {per_target(Slot::weights_gl), solved}, {index},
                [=, &gpu, &screen] { return run_gather_gl(shared, gpu, layer, screen.on_gpu); });
        } else {
            add_cpu("gather", gathered, {per_target(Slot::weights), solved}, {index}, [=, &gpu, &screen] {
                return run_gather(shared, gpu, layer, screen.surfaces, screen.weights, screen.light.layers);
            });
        }
        if (on_cpu && !shown_on_cpu)
            add("layers", per_target(Slot::layers, light.id), {lit, gathered, per_target(Slot::refined, light.id)},
                {index}, [=, &screen] { return run_layers(shared, layer, screen.surfaces, screen.light.layers); });
    }

    // Several luminaires at once. The passes have no luminaire.
    void add_merged(Together which) {
        const bool summed = which == Together::summed;
        const bool alone = in.refill.empty();  // else this frame solves one of them to the end
        ScreenLight& screen = in.screen;
        Merged& list = summed ? screen.light.summed_list : screen.light.merged;
        Besides* const into = summed ? &screen.light.summed : nullptr;
        const std::uint32_t id = summed ? kSummed : 0;
        const std::string prefix = summed ? "summed-" : "";
        const auto of_sum = [&](Slot slot) { return in.shares_sum ? per_light(slot, id) : per_target(slot, id); };
        const SlotRef merged = of_sum(Slot::merged), grid = per_target(Slot::grid), solved = of_sum(Slot::merged_solve);
        std::vector<SlotRef> reads;
        std::vector<std::uint64_t> key = {scene.lights_rev, scene.geometry_rev};
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            const Light& light = scene.lights[i];
            const bool both = in.in_sum != nullptr && in.in_sum->contains(light.id);
            if ((in.layers[i] < 0) != summed && !both) continue;
            key.push_back(light.id);
            const glm::dvec3 weight = summed ? context.weight_in_sum(light, in.layers[i]) : context.layer_weight(light);
            for (int k = 0; k < 3; ++k) key.push_back(bits(weight[k]));
            if (weight == glm::dvec3(0.0)) continue;
            reads.push_back(per_light(Slot::surfels, light.id));
            if (context.haze) reads.push_back(per_light(Slot::haze_surfels, light.id));
        }
        const std::vector<const LightGpu*> lights(in.lights.begin(), in.lights.end());
        PassContext shared = context;
        shared.rests = alone;
        for (std::size_t i = 0; i < scene.lights.size(); ++i)
            shared.rests &= (summed && in.layers[i] >= 0) || rests(scene.lights[i]);
        add_cpu(prefix + "merge", merged, std::move(reads), std::move(key),
                [=, &list] { return run_merge(shared, lights, which, list); });
        if (metered)
            add_cpu(prefix + "direct", per_target(Slot::direct, id), {merged}, {},
                    [=, &screen] { return run_direct_point_summed(shared, lights, screen.meter.summed[0]); });
        else if (summed || !by_gl) {
            Pass& direct =
                add_cpu(prefix + "direct", per_target(Slot::direct, id), {grid, merged}, {},
                        [=, &screen, &list] { return run_direct_merged(shared, screen.surfaces, list, into); });
            if (gathers_at_once() && finds_edges(context) && shows_lit_surfaces(in.view))
                direct.reads.push_back(per_target(Slot::edges));
        }
        add_cpu(prefix + "solve", solved, {merged}, {in.generation, in.solve_links()}, [=, &screen, &list] {
            const PassRun run = run_solve_merged(shared, list, screen.weights);
            screen.solved = list.irradiance.solved;
            return run;
        });
        passes.back().stale |= alone && !list.irradiance.converged;
        if (metered)
            add_cpu(prefix + "gather", per_target(Slot::gather, id), {solved}, {},
                    [=, &screen, &list] { return run_gather_point_summed(shared, list, screen.meter); });
        else if (summed || !by_gl)
            add_cpu(prefix + "gather", per_target(Slot::gather, id),
                    {per_target(by_gl ? Slot::weights_gl : Slot::weights), solved}, {}, [=, &screen, &list] {
                        return run_gather_merged(shared, screen.surfaces, screen.weights, list, into);
                    });
    }

    // What the pixels show, how they see the surfels, and what emissive surfaces bring them.
    void add_surfaces() {
        ScreenLight& screen = in.screen;
        // The CPU draws a G-buffer of its own: the other is for views that only shaders show, or shaders show all and
        // it is for what rays find.
        const bool raster = (on_cpu || by_gl) && !in.clusters.empty();
        const std::string beside = by_gl ? "-cpu" : "";
        add(raster && on_cpu ? "gbuffer-gl" : "gbuffer", per_target(Slot::gbuffer), {},
            {scene.geometry_rev, scene.camera_rev, context.bodies_stand}, [context = context, metered = metered] {
                return metered ? run_meter_gbuffer(context) : run_gbuffer(context);
            });
        if (raster) {
            add_cpu("gbuffer" + beside, per_target(Slot::grid), {},
                    {scene.geometry_rev, scene.camera_rev, context.bodies_stand, in.quality_level},
                    [context = context, &screen] { return run_raster(context, screen.surfaces); });
        } else if (!metered && !seed) {
            add_cpu("gbuffer-readback", per_target(Slot::grid), {per_target(Slot::gbuffer)}, {in.quality_level},
                    [context = context, &screen] { return run_grid(context, screen.surfaces); });
        }
        if (!metered && !seed) {
            add_cpu(
                "gather-weights" + beside, per_target(Slot::weights), {per_target(Slot::grid)}, {in.surface()},
                [context = context, &screen] { return run_gather_weights(context, screen.surfaces, screen.weights); });
        }
        if (gathers_at_once() && finds_edges(context) && shows_lit_surfaces(in.view))
            add_cpu("antialias", per_target(Slot::edges), {per_target(Slot::grid)}, {},
                    [context = context, &screen] { return run_antialias(context, screen); });
        if (by_gl)
            add("gather-weights", per_target(Slot::weights_gl), {per_target(Slot::gbuffer)}, {in.generation},
                [context = context, &screen] { return run_gather_weights_gl(context, screen.on_gpu); });
        Pass& emitted =
            add("gather-emitted", per_target(Slot::emitted),
                {per_target(metered ? Slot::gbuffer
                            : by_gl ? Slot::weights_gl
                                    : Slot::weights)},
                {in.generation}, [context = context, &screen, metered = metered] {
                    return metered ? run_gather_emitted_point(context, screen.meter)
                                   : run_gather_emitted(context, screen.surfaces, screen.weights, screen.light.emitted);
                });
        emitted.absent = !emits();
    }

    // What the pixels show of luminaires themselves.
    void add_openings() {
        std::vector<std::uint64_t> key = {scene.geometry_rev};
        for (const Light& light : scene.lights)
            if (has_opening(light))
                key.insert(key.end(), {light.id, light.position_rev, light.aim_rev, light.profile_rev});
        add_cpu("openings", per_target(Slot::openings), {per_target(Slot::grid)}, std::move(key),
                [context = context, &screen = in.screen] {
                    return run_openings(context, screen.surfaces, screen.light.openings);
                })
            .absent = !context.openings;
    }

    // Light at the pixels of a capture, and light without a layer for shaders.
    void add_whole() {
        ScreenLight& screen = in.screen;
        if (gathers_at_once()) {
            std::vector<SlotRef> reads = {per_target(Slot::weights)};
            if (emits()) reads.push_back(per_target(Slot::emitted));
            for (std::size_t i = 0; i < scene.lights.size(); ++i) {
                if (in.layers[i] >= 0) reads.push_back(per_target(Slot::gather, scene.lights[i].id));
            }
            if (in.layered() < scene.lights.size()) reads.push_back(per_target(Slot::gather, kSummed));
            add_cpu("gather-pixels", per_target(Slot::gathered), std::move(reads), {},
                    [context = context, &screen, lights = in.lights] {
                        return run_final_gather(context, lights, screen.surfaces, screen.weights, screen.light);
                    });
        }
        if (!shown_on_cpu && !besides().empty()) {
            std::vector<SlotRef> reads = besides();
            if (gathers_at_once() && shows_indirect(in.view)) reads.push_back(per_target(Slot::gathered));
            if (by_gl) reads.push_back(per_target(Slot::weights_gl));
            add("besides", per_target(Slot::besides), std::move(reads), {scene.master_rev, in.merged ? 1u : 0u},
                [context = context, &screen] {
                    return run_besides(context, screen.surfaces.gbuffer, screen.light, screen.on_gpu,
                                       screen.besides_unit_lx);
                });
        }
    }

    // One list of reads and one key: cut up it would pass both around.
    void add_composite() {
        std::vector<SlotRef> reads;
        std::vector<std::uint64_t> key = {static_cast<std::uint64_t>(in.view),
                                          bits(scene.view_gain),
                                          scene.exposure_rev,
                                          scene.master_rev,
                                          scene.lights_rev,
                                          scene.geometry_rev,
                                          in.merged ? 1u : 0u,
                                          shows_work_light(context) ? 1u : 0u};
        if (in.view <= View::indirect || in.view == View::solid) key.push_back(scene.look_rev);
        if (is_false_color(in.view)) key.insert(key.end(), {scene.view_rev, scene.presets_rev});
        std::vector<const LightGpu*> lights(in.lights.begin(), in.lights.end());
        const std::size_t shown_index = shown_light(scene);
        const LightGpu* shown = lights.empty() ? nullptr : lights[shown_index];
        if (shows_lit_surfaces(in.view)) {
            reads.push_back(per_target(shown_on_cpu ? Slot::grid : Slot::gbuffer));
            if (finds_edges(context)) reads.push_back(per_target(Slot::edges));
        }
        const std::vector<SlotRef> air = air_slots();
        reads.insert(reads.end(), air.begin(), air.end());
        if (context.openings && shows_openings(in.view)) reads.push_back(per_target(Slot::openings));
        if (shown_on_cpu) {
            const std::vector<SlotRef> more = besides();
            reads.insert(reads.end(), more.begin(), more.end());
        } else if (!besides().empty()) {
            reads.push_back(per_target(Slot::besides));
        }
        if (gathers_at_once() && shows_indirect(in.view)) reads.push_back(per_target(Slot::gathered));
        if (in.merged && !by_gl) {
            if (shows_direct(in.view)) reads.push_back(per_target(Slot::direct));
            if (shows_indirect(in.view)) reads.push_back(per_target(Slot::gather));
        }
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            const Light& light = scene.lights[i];
            key.push_back(light.level_rev);
            key.push_back(light.strobe_hz > 0.0 && light.flash_off);
            if (in.view == View::solid) key.insert(key.end(), {light.position_rev, light.aim_rev, light.profile_rev});
            if (in.layers[i] < 0) continue;  // of the summed slots
            reads.push_back(per_target(Slot::refined, light.id));
            const bool direct = shows_direct(in.view) || in.view == View::solid,
                       indirect = shows_indirect(in.view) || in.view == View::solid;
            if (in.merged) {  // the list reads them all
                if (by_gl && direct) reads.push_back(per_target(Slot::direct, light.id));
            } else if (on_cpu && !shown_on_cpu) {
                if (direct || indirect) reads.push_back(per_target(Slot::layers, light.id));
            } else {
                if (direct) reads.push_back(per_target(Slot::direct, light.id));
                if (indirect) reads.push_back(per_target(Slot::gather, light.id));
            }
        }
        if (shown != nullptr && in.view >= View::mask && in.view <= View::rsm_flux) {
            const std::uint32_t id = scene.lights[shown_index].id;
            key.push_back(id);
            reads.push_back(per_light(in.view == View::mask       ? Slot::mask
                                      : in.view == View::rsm_flux ? Slot::flux
                                                                  : Slot::rsm,
                                      id));
        }
        if (shown_on_cpu) {
            add_cpu("composite", per_target(Slot::nv12), std::move(reads), std::move(key),
                    [this_in = &in, context = context, lights = std::move(lights)] {
                        return run_composite_cpu(context, this_in->view, lights, this_in->screen);
                    });
            return;
        }
        add("composite", per_target(Slot::picture), std::move(reads), std::move(key),
            [this_in = &in, context = context, lights = std::move(lights), shown] {
                PassRun run = run_composite(context, this_in->view, shown, lights, this_in->screen, this_in->raw);
                if (this_in->view == View::solid && this_in->raw == 0) run.draws += run_solid(context, lights).draws;
                return run;
            });
    }
};

}  // namespace

std::vector<Pass> build_pipeline(const FrameInputs& in) {
    Builder b{in, {}};
    const Scene& scene = in.scene;
    b.passes.reserve(4 + 8 * scene.lights.size());
    b.add_surfaces();
    if (b.context.haze) b.add_haze_points();
    for (std::size_t i = 0; i < scene.lights.size(); ++i) b.add_light(i);
    if (scene.lights.empty()) {
        for (const char* name : {"shadow", "rsm", "mask", "rsm-flux", "surfels", "solve", "direct", "gather"}) {
            Pass& pass = b.passes.emplace_back();
            pass.name = name;
            pass.absent = true;
        }
    }
    if (in.can_merge()) b.add_merged(Together::layered);
    if (in.layered() < scene.lights.size()) b.add_merged(Together::summed);
    if (b.metered) return std::move(b.passes);
    if (b.context.haze) {
        b.add_air();
    } else {
        for (const char* name : {"haze-points", "haze-distances", "haze-surfels", "haze-rays", "haze-probes",
                                 "haze-seen", "haze-airlight", "haze-glow"}) {
            Pass& pass = b.passes.emplace_back();
            pass.name = name;
            pass.absent = true;
        }
    }
    b.add_whole();
    b.add_openings();
    b.add_composite();
    if (!b.shown_on_cpu && in.target.kind == TargetKind::live) {
        b.add("nv12", b.per_target(Slot::nv12), {b.per_target(Slot::picture)}, {},
              [context = b.context, view = in.view] { return run_nv12(context, view); });
    }
    return std::move(b.passes);
}

std::vector<SlotRef> wanted_slots(const FrameInputs& in, bool nv12) {
    std::vector<SlotRef> wanted;
    if (in.meter == FrameInputs::Meter::none) {
        wanted.push_back({nv12 ? Slot::nv12 : Slot::picture, in.target.id, 0});
        for (const std::uint32_t light : in.refill) {
            if (shows_direct(in.view)) wanted.push_back({Slot::direct, in.target.id, light});
            if (shows_indirect(in.view)) wanted.push_back({Slot::gather, in.target.id, light});
        }
        return wanted;
    }
    if (in.geometry.emissive() && in.scene.technique == Technique::standard && in.meter != FrameInputs::Meter::rsm)
        wanted.push_back({Slot::emitted, in.target.id, 0});
    if (in.layered() < in.scene.lights.size()) {
        wanted.push_back({Slot::direct, in.target.id, kSummed});
        wanted.push_back({Slot::gather, in.target.id, kSummed});
    }
    for (std::size_t i = 0; i < in.scene.lights.size(); ++i) {
        if (in.layers[i] < 0) continue;
        const Light& light = in.scene.lights[i];
        wanted.push_back({Slot::direct, in.target.id, light.id});
        wanted.push_back(in.meter == FrameInputs::Meter::rsm ? SlotRef{Slot::flux, 0, light.id}
                                                             : SlotRef{Slot::gather, in.target.id, light.id});
    }
    return wanted;
}

}  // namespace gonio
