// Tables of haze, of luminaires with a size, and of maps.
#include <algorithm>
#include <string>

#include "tests/bench/report_parts.h"

namespace gonio::bench {

static std::string percent(double ratio) {
    return fixed(100.0 * ratio, 1) + " %";
}

std::string beams_table(const Json& haze) {
    if (haze.is_null()) return kNotMeasured;
    std::string table = head_of({"scene, luminaires", "relative", "over the mean", "without the blocks at luminaires",
                                 "bias", "reference's noise", "bands below 64 pixels", "a millimetre"});
    for (const Json& row : haze.at("rows")) {
        const Json& bands = row.at("bands");
        double most = 0.0;
        for (std::size_t i = 0; i + 1 < bands.size(); ++i) most = std::max(most, bands.at(i).get<double>());
        table +=
            row_of({row.at("scene").get<std::string>() + ", " + std::to_string(row.at("lights").get<int>()),
                    percent(row.at("relative")), percent(row.at("rmse")), percent(row.at("rmse_beside")),
                    percent(row.at("bias")), percent(row.at("noise")), percent(most), percent(row.at("flicker_p99"))});
    }
    return table;
}

std::string haze_rates_table(const Json& clear, const Json& hazy) {
    if (clear.is_null() || hazy.is_null()) return kNotMeasured;
    std::string table = head_of({"what changes", "ms", "in haze, ms", "of the frame rate"});
    for (const auto& [change, title] : {std::pair("level_one", "level of one"),
                                        {"level_all", "level of all"},
                                        {"move_one", "position of one"},
                                        {"orbit", "camera"}}) {
        const auto ms = [change = change](const Json& file) {
            return row_where(file, {{"scene", "stage"}, {"change", change}, {"lights", 16}})
                .at("frame_ms")
                .get<double>();
        };
        table += row_of({title, figure(ms(clear)), figure(ms(hazy)), fixed(ms(clear) / ms(hazy), 2)});
    }
    return table;
}

std::string bakes_table(const Json& bake) {
    if (bake.is_null()) return kNotMeasured;
    std::string table = head_of({"scene", "texels a side", "in charts", "s", "M rays/s", "rmse", "rmse99", "bias",
                                 "live: s", "its rmse", "its rmse99", "its bias"});
    for (const Json& row : bake.at("rows"))
        table +=
            row_of({row.at("scene"), whole(row.at("side")), whole(row.at("texels")), figure(row.at("seconds")),
                    figure(1e-6 * row.at("rays_per_s").get<double>()), fixed(row.at("rmse"), 3),
                    fixed(row.at("rmse99"), 3), fixed(row.at("bias"), 3), figure(row.at("live_s")),
                    fixed(row.at("live_rmse"), 3), fixed(row.at("live_rmse99"), 3), fixed(row.at("live_bias"), 3)});
    return table;
}

std::string seed_bake_table(const Json& reference) {
    if (reference.is_null()) return kNotMeasured;
    std::string table = head_of({"the seed's case", "texels a side", "s", "s of processors", "M rays in each of these",
                                 "mean direct, lx", "all, lx"});
    for (const Json& row : reference.at("reference_case"))
        table += row_of({row.at("air").get<bool>() ? "with air" : "without air", whole(row.at("side")),
                         whole(row.at("seconds")), whole(row.at("cpu_s")),
                         figure(1e-6 * row.at("rays_per_s").get<double>() * row.at("seconds").get<double>() /
                                row.at("cpu_s").get<double>()),
                         fixed(row.at("mean_direct_lx"), 3), fixed(row.at("mean_lx"), 3)});
    return table;
}

}  // namespace gonio::bench
