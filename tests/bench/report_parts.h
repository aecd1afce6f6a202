// What the parts of the report share: saved results, numbers as text, Markdown tables.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace gonio::bench {

using Json = nlohmann::json;

std::string fixed(double x, int digits);
std::string whole(double x);          // a comma at every third digit: 2092 reads 2,092
std::string figure(double x);         // three figures of numbers below a thousand
std::string signed_figure(double x);  // three digits behind the point
std::string row_of(const std::vector<std::string>& cells);
std::string head_of(const std::vector<std::string>& cells);

// Result: the first of `rows`, or of a file's rows, that has these fields. Throws std::runtime_error where there is
// none.
const Json& one_where(const Json& rows, const std::map<std::string, Json>& fields);
const Json& row_where(const Json& file, const std::map<std::string, Json>& fields);

// What a folder of results holds. Of stress and the rest of its line: null where they were not run.
struct Saved {
    Json frames, lights, scaling, pareto, machine, refinement, transport;
    Json stress, stream, haze, haze_lights, clear_lights, with_panel, with_haze, bake, bake_reference;
    std::string ies;  // as ies-bench prints it
};

// Frames a second of the seed paper on its GPU.
inline constexpr std::pair<const char*, double> kPaperFps[] = {{"cornell", 49.0}, {"atrium", 47.0}};

inline constexpr const char* kNotMeasured = "Not measured on this machine.\n";  // instead of a table

std::string frames_table(const Json& frames);
std::string scaling_table(const Json& scaling);
std::string rsm_table(const Json& scaling);
std::string efforts_table(const Json& scaling);
std::string lights_table(const Json& lights);
std::string refinement_table(const Json& refinement);
std::string transport_table(const Json& transport);
std::string pareto_table(const Json& pareto);
std::string accuracy_table(const Json& pareto);  // of the default technique, against all bounces; null: none
// Beams in haze; 16 luminaires without and with it; maps, and the seed's case of them.
std::string beams_table(const Json& haze);
std::string haze_rates_table(const Json& clear, const Json& hazy);
std::string bakes_table(const Json& bake);
std::string seed_bake_table(const Json& reference);
std::string stress_table(const Json& stress);
std::string stream_table(const Json& stream);
// Result: the least time of this name that the seed technique's 400 samples took in a scene anywhere, ms: what held
// them up must not make a goal.
double least_of_seed(const Saved& saved, const char* scene, const char* ms);
// What was asked for at the default setting, and what is.
std::string goals_table(const Saved& saved);
// Which cases of `gonio-bench pareto` the results lack, as a sentence.
std::string pareto_gaps(const Json& pareto);

}  // namespace gonio::bench
