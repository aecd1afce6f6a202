// The words of commands for many lights, lights like another, the work light and the library; and how rows are printed.
#include <gtest/gtest.h>

#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/words.h"
#include "tests/unit/split.h"

namespace gonio {
namespace {

v1::Command command_of(const std::string& line) {
    const auto command = command_from_words(split(line));
    EXPECT_TRUE(command) << line << ": " << (command ? "" : command.error().text());
    return command ? *command : v1::Command();
}

TEST(CliLights, ManyAtOnce) {
    const v1::EditLights set = command_of("set lights key wash fill --level 30% --tint 0.01").edit_lights();
    ASSERT_EQ(set.names_size(), 3);
    EXPECT_EQ(set.names(1), "wash");
    EXPECT_DOUBLE_EQ(set.same().level_ratio(), 0.3);
    EXPECT_DOUBLE_EQ(set.same().tint_duv(), 0.01);
    EXPECT_EQ(command_of("set lights key --profile flood").edit_lights().same().profile().name(), "flood");
    const v1::EditLights removal = command_of("remove lights key wash").edit_lights();
    ASSERT_EQ(removal.remove_size(), 2);
    EXPECT_EQ(removal.remove(1), "wash");
}

TEST(CliLights, LikeAnother) {
    const v1::AddLight add = command_of("add light copy --like key --position 1,2,3 --multiplier 2").add_light();
    EXPECT_EQ(add.light().name(), "copy");
    EXPECT_EQ(add.like(), "key");
    EXPECT_EQ(add.light().position_m(2), 3);
    EXPECT_EQ(add.multiplier(), 2);
    EXPECT_FALSE(add.light().has_profile());
}

TEST(CliLights, WorkLightIsOnOrOff) {
    EXPECT_TRUE(command_of("set work-light on").set_view().work_light());
    const v1::Command off = command_of("set work-light off");
    EXPECT_TRUE(off.set_view().has_work_light());
    EXPECT_FALSE(off.set_view().work_light());
}

TEST(CliLights, ASearchOfTheLibraryHasItsBoundsInRadians) {
    const ReadWords words = read_command_line(split("library acme spot --min-flux 500 --max-beam 90 --count 5"));
    ASSERT_FALSE(words.fault);
    EXPECT_EQ(words.names, (std::vector<std::string>{"acme", "spot"}));
    EXPECT_EQ(words.message.library().min_flux_lm(), 500);
    EXPECT_NEAR(words.message.library().max_beam_rad(), 1.5707963, 1e-6);
    EXPECT_FALSE(words.message.library().has_min_beam_rad());
    EXPECT_EQ(words.message.library().count(), 5u);
    EXPECT_EQ(read_command_line(split("library --count 0")).fault.value_or(Error{}).where, "--count") << "no default";
}

TEST(CliLights, RowsOfTheLibraryArePrinted) {
    v1::Library library;
    v1::LibraryRow& good = *library.add_rows();
    good.set_name("k7.ies");
    v1::PhotometrySummary& summary = *good.mutable_summary();
    summary.set_flux_lm(900);
    summary.set_beam_rad(1.5707963);
    summary.set_description("Acme Lumen");
    v1::LibraryRow& bad = *library.add_rows();
    bad.set_name("broken.ies");
    bad.set_error("The file ends.");
    library.set_found(2);
    library.set_total(10);
    library.set_reading(true);
    const std::string text = library_table(library);
    EXPECT_NE(text.find("900"), std::string::npos);
    EXPECT_NE(text.find("90.0"), std::string::npos) << text;
    EXPECT_NE(text.find("Acme Lumen"), std::string::npos);
    EXPECT_NE(text.find("not usable: The file ends."), std::string::npos);
    EXPECT_NE(text.find("2 of 2 found, 10 in all; folders are being read"), std::string::npos);
}

}  // namespace
}  // namespace gonio
