#include "tests/bench/operations.h"

#include "server/render/quality.h"

namespace gonio::bench {
namespace {

constexpr const char* kScenes[] = {"cornell", "atrium"};
// Lanes of the widest vectors: what is done one at a time has this part of the measured rate.
constexpr double kLanesOfRate = 16.0;

// A picture's counts (counts.h) beside its row of times.
struct Counted {
    const Json &row, &counts;
    double of(const char* name) const { return counts.at(name); }
    double pixels() const { return row.at("side_px").get<double>() * row.at("side_px").get<double>(); }
    double points() const { return pixels() / 16.0; }
    double close() const { return static_cast<double>(kClose.share) * points(); }
    double terms() const { return row.at("occlusion_rays"); }
    double evaluations() const { return row.at("vpl_evaluations"); }
    // Points that are lit each for itself; second points with half the rays to VPLs.
    double own() const { return close() + of("second_points"); }
    double short_rays() const { return of("points") + own() * kClose.near_rays; }
    double asked() const { return (close() + 0.5 * of("second_points")) * kClose.asked; }
    static constexpr shade::Close kClose = kLive.close;
};
Counted counted_in(const Json& scaling, const std::string& scene) {
    const Json& row = default_row(scaling, scene);
    return {row, one_where(scaling.at("counts"), {{"scene", scene}})};
}

// What a kernel does how often. Counted are operations on floats, in each lane: sums, products, comparisons, choices,
// conversions and first approximations one each, a multiply-add two, a quotient five (an approximation and a Newton
// step), the reciprocal of a root six; loads, stores, gathers and integers none. alone: not in lanes.
struct Step {
    const char *pass, *kernel;
    double operations;
    const char *each, *derived;
    double (*times)(const Counted&);
    bool alone = false;
};
constexpr Step kSteps[] = {
    {"gbuffer", "Project", 59, "vertex", "difference 3, three dot products 15, pixels on both sides of it 41",
     [](const Counted& c) { return c.of("vertices"); }},
    {"gbuffer", "set_up", 129, "triangle drawn",
     "five tests of three corners 21, three cross products 27, volume 5, its scale and tests 12, three edges with "
     "their "
     "slack 64",
     [](const Counted& c) { return c.of("drawn"); }, true},
    {"gbuffer", "RasterTriangle: row", 9, "row of a triangle", "three edges and the depth 8, a conversion",
     [](const Counted& c) { return c.of("rows"); }, true},
    {"gbuffer", "RasterTriangle: ends", 24, "wide row", "sign, quotient 5, step, bound for three edges",
     [](const Counted& c) { return c.of("wide_rows"); }, true},
    {"gbuffer", "RasterTriangle", 14, "pixel tested",
     "conversion 1, three edges 6, depth 2, least 2, three comparisons 3",
     [](const Counted& c) { return c.of("covered"); }},
    {"gbuffer", "ShadeStrip", 168, "pixel",
     "place 2, 1/depth 6, weights 12, three normals unpacked 84 and mixed 15, unit length 16, packed 25, half floats 8",
     [](const Counted& c) { return c.of("pixels"); }},
    {"gbuffer", "ShadeStrip: texture", 230, "pixel with one",
     "place 10, width on the surface 33, level 21, two levels of four texels 150, mixed 16",
     [](const Counted& c) { return c.of("textured"); }},
    {"gbuffer", "WeightsRow", 174, "pixel",
     "depth 6, position 14, normal 28, 1/near 7, four points of 25, 255 over their sum 11, bytes 8",
     [](const Counted& c) { return c.of("pixels"); }},
    {"direct", "DirectRow", 102, "pixel",
     "depth 6, position 13, normal 28, way to the luminaire 9, cosine 13, ray's start 8, turned 15, quotient 7, "
     "choices 3",
     [](const Counted& c) { return c.of("pixels"); }},
    {"direct", "web_ratio", 57, "pixel",
     "angle 36, place on the axis 14, between two values 7; twice that for other webs",
     [](const Counted& c) {
         const bool plain = c.counts.at("web_symmetric").get<bool>() && c.counts.at("web_even").get<bool>();
         return c.of("pixels") * (plain ? 1.0 : 2.0);
     }},
    {"direct", "looks_like", 10, "2 × 2 pixels", "four comparisons, off the plane 6",
     [](const Counted& c) { return c.of("blocks"); }, true},
    {"direct", "ShadowRays", 3, "ray", "its direction", [](const Counted& c) { return c.of("lit_blocks"); }, true},
    {"occlusion", "Terms", 32, "node and VPL", "as Gather, with one colour",
     [](const Counted& c) { return c.terms(); }},
    {"occlusion", "VplQuery", 9, "node and VPL", "direction 3, two sums 4; variance: square and sum 2",
     [](const Counted& c) { return c.terms(); }},
    {"occlusion", "FilterNodesRow", 401, "node", "nine neighbours of 43, 14 more",
     [](const Counted& c) { return c.points() / 16.0; }},
    {"gather", "Gather", kFlopsPerEvaluation, "point and VPL",
     "difference 3, its square 5, two cosines 10, signs and bounds 3, numerator 1, denominator 4, quotient 5, three "
     "colours 6",
     [](const Counted& c) { return c.evaluations() + c.own() * Counted::kClose.summed; }},
    {"gather", "Terms, Shares", 33, "point of a close block or second one, and VPL",
     "as Gather, with one colour, and their sum", [](const Counted& c) { return c.own() * Counted::kClose.listed; }},
    {"gather", "ShortRays, Brings", 446, "short ray",
     "the ray 46; what it meets: place 39, three normals 123, way to the luminaire 59, the web twice 127, weight 32, "
     "colours 20",
     [](const Counted& c) { return c.short_rays(); }},
    {"gather", "seen_at", 172, "point", "four nodes of 40, 12 more", [](const Counted& c) { return c.points(); }, true},
    {"gather", "FilterRow", 495, "point", "sixteen neighbours of 30, 15 more",
     [](const Counted& c) { return c.points(); }},
    {"composite", "UpsampleRow", 43, "pixel",
     "four weights 4, one over their sum 9, three colours of 7 and by it 24, half floats 6",
     [](const Counted& c) { return c.of("pixels"); }},
    {"composite", "SumRow", 13, "pixel", "half float 1, three colours in quanta 12",
     [](const Counted& c) { return c.of("pixels"); }},
    {"composite", "EncodeRow", 58, "pixel", "quanta 6, indirect light 9, reflectance 6, tone 30, dither and choice 7",
     [](const Counted& c) { return c.of("pixels"); }},
    {"composite", "Nv12Rows", 15.75, "pixel", "luma 9, a quarter of 27 for the chroma of four",
     [](const Counted& c) { return c.of("pixels"); }}};

struct Pass {
    const char* name;
    double bytes_each;  // that are read or written at least once
    double (*times)(const Counted&);
    const char* bytes_of;
    double (*shadow_rays)(const Counted&);
    double (*vpl_rays)(const Counted&);
    double (*short_rays)(const Counted&);
};
double none(const Counted&) {
    return 0.0;
}
constexpr auto kPixels = [](const Counted& c) { return c.pixels(); };
constexpr Pass kPasses[] = {
    {"gbuffer", 20.25, kPixels, "a pixel: depth 4, normal 4, albedo 8, weights 4 and how many are poor 0.25 written",
     none, none, none},
    {"direct", 14.0, kPixels, "a pixel: depth and normal read, 4 + 2 written",
     [](const Counted& c) { return c.of("lit_blocks"); }, none, none},
    {"occlusion", 28.0, [](const Counted& c) { return c.points() / 16.0; }, "a node", none,
     [](const Counted& c) { return c.of("vpl_rays"); }, none},
    {"gather", 52.0, [](const Counted& c) { return c.points(); }, "a point: points and nodes read, light written", none,
     [](const Counted& c) { return c.asked(); }, [](const Counted& c) { return c.short_rays(); }},
    {"composite", 35.5, kPixels,
     "a pixel: weights, depth, albedo, direct read, indirect brought there and read, NV12 written", none, none, none}};

// Milliseconds and amounts of one pass, or of all.
struct Limit {
    double measured_ms = 0.0, operations = 0.0, operations_ms = 0.0, bytes = 0.0, bytes_ms = 0.0, rays = 0.0,
           rays_ms = 0.0;
    void add(const Limit& other) {
        measured_ms += other.measured_ms;
        operations += other.operations, operations_ms += other.operations_ms;
        bytes += other.bytes, bytes_ms += other.bytes_ms;
        rays += other.rays, rays_ms += other.rays_ms;
    }
};
Limit limit_of(const Pass& pass, const Counted& counted, const Json& machine) {
    Limit limit;
    limit.measured_ms = counted.row.at("pass_ms").value(pass.name, 0.0);
    for (const Step& step : kSteps) {
        if (std::string_view(step.pass) != pass.name) continue;
        const double operations = step.operations * step.times(counted);
        limit.operations += operations;
        limit.operations_ms +=
            operations * (step.alone ? kLanesOfRate : 1.0) * 1e3 / machine.at("flops_per_s").get<double>();
    }
    limit.bytes = pass.bytes_each * pass.times(counted);
    limit.bytes_ms = limit.bytes * 1e3 / machine.at("bytes_per_s").get<double>();
    const Json& rates = one_where(machine.at("rays"), {{"scene", counted.counts.at("scene")}});
    const auto add = [&](double rays, const char* rate) {
        limit.rays += rays;
        limit.rays_ms += rays * 1e3 / rates.at(rate).get<double>();
    };
    add(pass.shadow_rays(counted), "shadow_per_s");
    add(pass.vpl_rays(counted), "vpl_per_s");
    add(pass.short_rays(counted), "short_per_s");
    return limit;
}

}  // namespace

std::string operations_table(const Json& scaling) {
    std::string table = head_of({"pass", "kernel", "operations", "for each", "derived", "cornell, 10⁶", "atrium, 10⁶"});
    std::string before;
    for (const Step& step : kSteps) {
        std::vector<std::string> cells = {step.pass == before ? "" : step.pass,
                                          std::string(step.kernel) + (step.alone ? ", one at a time" : ""),
                                          figure(step.operations), step.each, step.derived};
        for (const char* scene : kScenes)
            cells.push_back(fixed(step.operations * step.times(counted_in(scaling, scene)) * 1e-6, 1));
        table += row_of(cells);
        before = step.pass;
    }
    return table;
}

std::string limits_table(const Json& scaling, const Json& machine) {
    std::string table =
        head_of({"scene", "pass", "measured ms", "operations, 10⁶", "at the machine's rate, ms", "memory, MB",
                 "at the machine's rate, ms", "rays, 10⁶", "at their rates alone, ms", "bytes"});
    for (const char* scene : kScenes) {
        const Counted counted = counted_in(scaling, scene);
        const auto add = [&](const std::string& name, const std::string& pass, const Limit& limit, const char* bytes) {
            table += row_of({name, pass, fixed(limit.measured_ms, 1), fixed(limit.operations * 1e-6, 1),
                             fixed(limit.operations_ms, 2), fixed(limit.bytes * 1e-6, 1), fixed(limit.bytes_ms, 2),
                             limit.rays > 0.0 ? fixed(limit.rays * 1e-6, 2) : "",
                             limit.rays > 0.0 ? fixed(limit.rays_ms, 1) : "", bytes});
        };
        Limit all;
        for (const Pass& pass : kPasses) {
            const Limit limit = limit_of(pass, counted, machine);
            add(&pass == kPasses ? scene : "", pass.name, limit, pass.bytes_of);
            all.add(limit);
        }
        add("", "all five", all, "");
    }
    return table;
}

std::map<std::string, std::string> limit_figures(const Json& scaling, const Json& machine) {
    std::map<std::string, std::string> figures = {{"encoder_ms", fixed(machine.at("encoder_ms"), 1)},
                                                  {"flops_per_evaluation", fixed(kFlopsPerEvaluation, 0)}};
    for (const char* scene : kScenes) {
        const std::string name = scene;
        const Counted counted = counted_in(scaling, scene);
        const Json& rates = one_where(machine.at("rays"), {{"scene", scene}});
        for (const auto& [kind, rate] :
             {std::pair("shadow", "shadow_per_s"), {"vpl", "vpl_per_s"}, {"short", "short_per_s"}})
            figures[name + "_" + kind + "_rate"] = figure(rates.at(rate).get<double>() * 1e-6);
        Limit all;
        for (const Pass& pass : kPasses) {
            const Limit limit = limit_of(pass, counted, machine);
            all.add(limit);
            figures[name + "_" + pass.name + "_ms"] = fixed(limit.measured_ms, 1);
            figures[name + "_" + pass.name + "_of_memory"] = fixed(limit.measured_ms / limit.bytes_ms, 0);
            figures[name + "_" + pass.name + "_of_operations"] = fixed(limit.measured_ms / limit.operations_ms, 0);
            if (limit.rays > 0.0)
                figures[name + "_" + pass.name + "_traced"] = figure(limit.rays * 1e-3 / limit.measured_ms);
        }
        const double frame_ms = counted.row.at("frame_ms");
        figures[name + "_frame_ms"] = fixed(frame_ms, 1);
        figures[name + "_rays"] = fixed(all.rays * 1e-6, 2);
        figures[name + "_rays_ms"] = fixed(all.rays_ms, 1);
        figures[name + "_rays_share"] = fixed(100.0 * all.rays_ms / frame_ms, 0);
        figures[name + "_without_rays_ms"] = fixed(frame_ms - all.rays_ms, 1);
        figures[name + "_operations_ms"] = fixed(all.operations_ms, 1);
    }
    return figures;
}

}  // namespace gonio::bench
