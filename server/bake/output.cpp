#include "server/bake/output.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "server/assets/assets.h"
#include "server/bake/glb.h"
#include "server/bake/ktx.h"
#include "server/bake/seams.h"
#include "server/base/atomic_file.h"
#include "server/base/clock.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"

namespace gonio::bake {
namespace {

using Json = nlohmann::ordered_json;

constexpr float kRoom = 32768.0f;  // halves and shared exponents hold 65,504 and 65,408

// Result: the power of two that brings the greatest value to at most kRoom; never above 1.
float scale_of(std::span<const float> values) {
    float greatest = 0.0f;
    for (const float value : values) greatest = std::max(greatest, value);
    return greatest > kRoom ? std::exp2(-std::ceil(std::log2(greatest / kRoom))) : 1.0f;
}

class Folder {
public:
    Folder(const OutputSettings& settings, const Layout& layout) : settings_(settings), layout_(layout) {}

    Result<bool> write(const std::string& name, std::string_view bytes) const {
        return write_file_atomically((std::filesystem::path(settings_.folder) / name).string(), bytes);
    }

    // values: of texels. Result: what maps.json says of the file.
    Result<Json> write_map(const std::string& name, std::span<const float> values, int channels, bool level) const {
        std::vector<float> picture = picture_of(layout_.atlas, layout_.fill, values, channels);
        if (level) level_seams(layout_.atlas, layout_.fill, picture, channels);
        return write_picture(name, std::move(picture), channels);
    }

    Result<Json> write_picture(const std::string& name, std::vector<float> picture, int channels) const {
        const float scale = settings_.half ? scale_of(picture) : 1.0f;
        if (scale != 1.0f) {
            for (float& value : picture) value *= scale;
        }
        FloatPicture file{layout_.atlas.width, layout_.atlas.height, channels, std::move(picture)};
        const auto bytes = encode_exr(file, "lx", false, settings_.half);
        if (!bytes) return bytes.error();
        const auto written = write(name, std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
        if (!written) return written.error();
        return Json{{"file", name}, {"channels", channels}, {"lx_per_unit", 1.0f / scale}};
    }

private:
    const OutputSettings& settings_;
    const Layout& layout_;
};

double root_mean_square(const Layout& layout, std::span<const float> values) {
    std::vector<float> squares(values.begin(), values.end());
    for (float& value : squares) value *= value;
    return std::sqrt(mean_over_area(layout, squares, 1));
}

std::string scene_file(const std::string& scene) {
    const std::string stem = std::filesystem::path(scene).stem().string();
    return file_names({stem})[0] + ".glb";
}

Json haze_of(const HazeValues& haze) {
    return {{"extinction_per_m", haze.extinction_per_m},
            {"albedo", haze.albedo},
            {"g", haze.g},
            {"layer_height_m", haze.layer_height_m}};
}

}  // namespace

Result<Summary> bake_to_folder(const Scene& scene, const trace::Geometry& geometry, const BakeSettings& settings,
                               const OutputSettings& output,
                               const std::function<void(const std::string&, int, int)>& begins, Work& work) {
    const std::int64_t begin_ns = monotonic_ns();
    const auto sources = sources_of(scene, geometry, settings);
    if (!sources) return sources.error();
    std::error_code failed;
    std::filesystem::create_directories(output.folder, failed);
    if (failed) return Error{"file_unwritable", "bake.out", output.folder, failed.message()};
    const auto lock = FileLock::take((std::filesystem::path(output.folder) / "maps.json").string());
    if (!lock) return Error{"busy", "bake.out", output.folder, "another bake writes to this folder"};
    const auto layout = lay_out(scene, geometry, settings, work);
    if (!layout) return layout.error();
    const Folder folder(output, *layout);
    const std::size_t texels = layout->atlas.texels.size();
    std::vector<float> sum(3 * texels, 0.0f), error2(texels, 0.0f);
    Summary summary;
    Json maps = Json::array();
    BakeEvents events;
    events.begins = begins;
    events.finished = [&](const Layout& of, const Source& source, const SourceMaps& made) -> Result<bool> {
        auto direct = folder.write_map(source.name + "_direct.exr", made.direct, source.direct_channels, true);
        if (!direct) return direct.error();
        auto indirect = folder.write_map(source.name + "_indirect.exr", made.indirect, 3, true);
        if (!indirect) return indirect.error();
        const float error_weight = trace::luminance(source.weight);
        glm::dvec3 mean_direct(0.0);
        for (std::size_t i = 0; i < texels; ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                const float weight = source.weight[static_cast<int>(c)],
                            first = source.direct_channels == 3 ? made.direct[3 * i + c] : made.direct[i];
                sum[3 * i + c] += weight * (first + made.indirect[3 * i + c]);
                if (of.atlas.texels[i].valid)
                    mean_direct[static_cast<int>(c)] +=
                        static_cast<double>(of.atlas.texels[i].area_m2 * weight * first) / of.area_m2;
            }
            error2[i] += error_weight * error_weight * made.error[i] * made.error[i];
        }
        summary.mean_direct_lx += trace::luminance(mean_direct);
        double mean = made.mean_direct_lx;
        for (const double lx : made.mean_bounces_lx) mean += lx;
        summary.means_lx.emplace_back(source.name, mean);
        summary.computed += made.computed, summary.taken_over += made.taken_over;
        summary.rays += made.rays;
        (*direct)["mean_lx"] = made.mean_direct_lx;
        (*indirect)["mean_lx"] = mean - made.mean_direct_lx;
        (*indirect)["bounces_mean_lx"] = made.mean_bounces_lx;
        (*indirect)["further_bounces_lx"] = made.rest_lx;
        maps.push_back({{"name", source.name},
                        {"light", source.light},
                        {"weight", {source.weight.r, source.weight.g, source.weight.b}},
                        {"direct", std::move(*direct)},
                        {"indirect", std::move(*indirect)},
                        {"error_lx", root_mean_square(of, made.error)},
                        {"rays", made.rays},
                        {"seconds", made.seconds},
                        {"rays_per_s", made.seconds > 0.0 ? static_cast<double>(made.rays) / made.seconds : 0.0},
                        {"computed", made.computed},
                        {"taken_over", made.taken_over},
                        {"hash", source.key}});
        return true;
    };
    const PartStore store((std::filesystem::path(output.folder) / "parts").string());
    if (const auto done = bake(scene, geometry, *layout, *sources, settings, store, events, work); !done)
        return done.error();
    std::vector<float> picture = picture_of(layout->atlas, layout->fill, sum, 3);
    level_seams(layout->atlas, layout->fill, picture, 3);
    auto whole = folder.write_picture("sum.exr", picture, 3);
    if (!whole) return whole.error();
    for (float& value : error2) value = std::sqrt(value);
    auto error = folder.write_map("error.exr", error2, 1, false);
    if (!error) return error.error();
    const float scale = scale_of(picture);
    if (const auto kept =
            folder.write("sum.ktx2", ktx2_rgb9e5(picture, layout->atlas.width, layout->atlas.height, scale));
        !kept)
        return kept.error();
    Json glb;
    if (output.glb) {
        const std::string name = scene_file(scene.asset->name);
        const auto bytes = lit_glb(*scene.asset, *layout, picture);
        if (!bytes) return bytes.error();
        if (const auto kept = folder.write(name, *bytes); !kept) return kept.error();
        glb = name;
    }
    summary.width = layout->atlas.width, summary.height = layout->atlas.height;
    summary.charts = layout->atlas.places.size(), summary.texels = texels;
    summary.mean_lx = mean_over_area(*layout, sum, 3);
    summary.error_lx = root_mean_square(*layout, error2);
    summary.seconds = seconds_since(begin_ns);
    (*whole)["mean_lx"] = summary.mean_lx;
    (*error)["root_mean_square_lx"] = summary.error_lx;
    const Json document = {
        {"format", "gonio maps 1"},
        {"scene", scene.asset->name},
        {"size", {layout->atlas.width, layout->atlas.height}},
        {"unit", "lx"},
        {"origin", "top left; TEXCOORD_1 of the glb"},
        {"texel_m", layout->atlas.texels_per_m > 0.0 ? Json(1.0 / layout->atlas.texels_per_m) : Json()},
        {"gutter_texels", kGutter},
        {"charts", summary.charts},
        {"texels", texels},
        {"area_m2", layout->area_m2},
        {"invalid_m2", layout->invalid_m2},
        {"directions", settings.directions},
        {"bounces", settings.bounces},
        {"tolerance", settings.tolerance},
        {"haze", haze_of(scene.haze)},
        {"hash", layout->key},
        {"sum", std::move(*whole)},
        {"sum_ktx2", {{"file", "sum.ktx2"}, {"lx_per_unit", 1.0f / scale}}},
        {"error", std::move(*error)},
        {"glb", std::move(glb)},
        {"rays", summary.rays},
        {"seconds", summary.seconds},
        {"rays_per_s", summary.seconds > 0.0 ? static_cast<double>(work.rays) / summary.seconds : 0.0},
        {"maps", std::move(maps)}};
    if (const auto kept =
            folder.write("maps.json", document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
        !kept)
        return kept.error();
    return summary;
}

}  // namespace gonio::bake
