// Every case in every quality that can meet it. Without EGL the real-time qualities are skipped (with CI set that is a
// failure); the reference needs none.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <set>
#include <stdexcept>

#include "server/gl/context.h"
#include "tests/accuracy/measure.h"
#include "tests/scenes/show.h"

namespace gonio::accuracy {

std::unique_ptr<gl::Context> the_context;

namespace {

using Quality = Renderer::MeterQuality;

class Accuracy : public testing::TestWithParam<std::size_t> {
protected:
    const Case& c() const { return cases()[GetParam()]; }
};

TEST_P(Accuracy, Reference) {
    const std::vector<Value> values = by_reference(c());
    ASSERT_EQ(values.size(), c().figures.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const Figure& figure = c().figures[i];
        const double difference = relative_difference(c(), figure, values[i].value);
        EXPECT_LE(std::abs(difference), c().reference_tolerance)
            << figure.name << ": " << values[i].value << " ± " << values[i].error << " " << c().unit << ", expected "
            << figure.expected;
        // Chance must not decide: what the reference says of its own noise leaves room for three of its errors.
        EXPECT_LE(3 * values[i].error, 1.001 * c().reference_tolerance * std::max(figure.expected, values[i].value))
            << figure.name;
    }
}

void expect_within(const Case& c, Quality quality, double tolerance) {
    if (!the_context) GTEST_SKIP() << "no EGL";
    Renderer renderer(*the_context);
    if (c.part == Part::direct) test::make_coarse(renderer);
    const std::vector<Value> values = by_renderer(renderer, c, quality);
    for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_LE(std::abs(relative_difference(c, c.figures[i], values[i].value)), tolerance)
            << c.figures[i].name << ": " << values[i].value << " " << c.unit << ", expected " << c.figures[i].expected;
    }
}

TEST_P(Accuracy, Rsm) {
    if (!c().rsm_tolerance) GTEST_SKIP() << c().limit;
    expect_within(c(), Quality::rsm, *c().rsm_tolerance);
}

TEST_P(Accuracy, Interactive) {
    if (!c().interactive_tolerance) GTEST_SKIP() << c().limit;
    expect_within(c(), Quality::interactive, *c().interactive_tolerance);
}

std::string test_name(const testing::TestParamInfo<std::size_t>& info) {
    std::string name = cases()[info.param].id;
    for (char& letter : name) {
        if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
    }
    return name;
}

std::vector<std::size_t> those(bool variants) {
    std::vector<std::size_t> list;
    for (std::size_t i = 0; i < cases().size(); ++i) {
        if (cases()[i].variant == variants) list.push_back(i);
    }
    return list;
}

INSTANTIATE_TEST_SUITE_P(Cases, Accuracy, testing::ValuesIn(those(false)), test_name);
INSTANTIATE_TEST_SUITE_P(Variants, Accuracy, testing::ValuesIn(those(true)), test_name);

TEST(Cases, AreWhatTheTableSays) {
    std::set<std::string> ids;
    for (const Case& c : cases()) {
        EXPECT_TRUE(ids.insert(c.id).second) << c.id;
        EXPECT_FALSE(c.figures.empty()) << c.id;
        EXPECT_EQ(c.limit.empty(), c.rsm_tolerance.has_value()) << c.id << ": a limit, or figures that are met";
        for (const Figure& figure : c.figures) EXPECT_FALSE(figure.samples.empty()) << c.id << " " << figure.name;
    }
}

}  // namespace
}  // namespace gonio::accuracy

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (GTEST_FLAG_GET(list_tests)) return RUN_ALL_TESTS();
    try {
        gonio::accuracy::the_context = gonio::gl::Context::create({-1, true});
    } catch (const std::runtime_error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        if (std::getenv("CI") != nullptr) return 1;
    }
    const int result = RUN_ALL_TESTS();
    gonio::accuracy::the_context.reset();
    return result;
}
