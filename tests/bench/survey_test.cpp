// The survey: what it says of a room follows from what it read at the points, and a room that nobody tuned is right.
#include "tests/bench/survey.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

namespace gonio::bench {
namespace {

using Json = nlohmann::json;

TEST(Survey, FiguresFollowFromThePoints) {
    SurveyOptions options;
    options.rooms = "3:2", options.picks = 6, options.links = 64, options.reference_seconds = 1.0, options.json = true;
    options.cache = (std::filesystem::temp_directory_path() / ("gonio-survey-" + std::to_string(getpid()))).string();
    std::ostringstream out, progress;
    run_survey(options, out, progress);
    std::filesystem::remove_all(options.cache);
    const Json json = Json::parse(out.str());
    EXPECT_EQ(json["scenes"], 2);
    EXPECT_EQ(json["points"], 12);
    EXPECT_EQ(json["off_by_half"], 0) << progress.str();
    EXPECT_EQ(json["off_by_two"], 0) << progress.str();
    unsigned within = 0;
    double worst_rms = 0.0;
    for (const Json& row : json["rows"]) {
        double mean = 0.0, squares = 0.0, noise = 0.0;
        for (const Json& pick : row["picks"]) mean += pick["reference_lx"].get<double>() / 6.0;
        for (const Json& pick : row["picks"]) {
            const double off = pick["interactive_lx"].get<double>() - pick["reference_lx"].get<double>(),
                         error = pick["reference_error_lx"], stated = pick["stated_error_lx"];
            squares += off * off / 6.0, noise += error * error / 6.0;
            within += std::abs(off) <= 2.0 * std::sqrt(stated * stated + error * error) ? 1 : 0;
            EXPECT_GT(stated, 0.0);
        }
        EXPECT_GT(mean, 0.0);
        EXPECT_NEAR(row["rms"].get<double>(), std::sqrt(std::max(0.0, squares - noise)) / mean, 1e-9);
        EXPECT_LT(row["rms"].get<double>(), 0.1) << row["scene"];
        worst_rms = std::max(worst_rms, row["rms"].get<double>());
    }
    EXPECT_NEAR(json["within_twice_stated"].get<double>(), within / 12.0, 1e-9);
    EXPECT_EQ(json["worst_rms"].get<double>(), worst_rms);
}

TEST(Survey, BadOptionsAreRefused) {
    std::ostringstream out, progress;
    for (const char* rooms : {"", "1", "1:0", "1:2:3", "a:b"}) {
        SurveyOptions options;
        options.rooms = rooms;
        EXPECT_THROW(run_survey(options, out, progress), std::runtime_error) << rooms;
    }
    SurveyOptions nowhere;
    nowhere.paths = {"/nonexistent/scene.glb"};
    EXPECT_THROW(run_survey(nowhere, out, progress), std::runtime_error);
}

}  // namespace
}  // namespace gonio::bench
