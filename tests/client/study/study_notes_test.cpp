#include "client/study/study.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "client/study/study_file.h"

namespace oblique::client {
namespace {

using Notes = void(std::ostream&, const protocol::Recipe&);

std::string notes_of(Notes* write, const std::string& model, const std::string& block) {
  std::ostringstream out;
  const auto any_reach = [](const protocol::PointTable&) {};
  const std::string text = "[model]\n" + model + "\n[[block]]\n" + block;
  write(out, parse_study(text, "a.toml", any_reach).recipe);
  return out.str();
}

std::string mesh_note(const std::string& model, const std::string& axis = {}) {
  return notes_of(note_coarse_mesh, model, "H = 0.6\nmu = [0.4, 0.6]\ne = 1\n" + axis);
}

std::string value_notes(const std::string& model, const std::string& block) {
  return notes_of(note_unusual_values, model, block);
}

TEST(MeshNote, GivesTheErrorsOfThePublishedMeshInOneLine) {
  EXPECT_EQ(
      mesh_note("preset = 'paper'"),
      "Note: 4 elements a link give errors of 3 % in forces, 12 % in durations, and another "
      "sequence of states for 4 in 10 points, compared with 48; use preset = \"standard\" for "
      "predictions\n");
}

TEST(MeshNote, IsForTheCoarsestMeshBelowEightElements) {
  const struct {
    const char* model;
    const char* axis;
    const char* expected;  // empty: no note
  } cases[] = {
      {"", "", ""},
      {"preset = 'converged'", "", ""},
      {"elements_per_link = 8", "", ""},
      {"preset = 'paper'", "elements_per_link = [8, 16]\n", ""},
      {"elements_per_link = 7", "", "7 elements a link give errors of up to 3"},
      {"elements_per_link = 2", "", "more than 12 % in durations"},
      {"", "elements_per_link = [16, 4]\n", "Note: 4 elements"},
      {"", "elements_per_link = {from = 2, to = 16, step = 2}\n", "Note: 2 elements"},
  };
  for (const auto& [model, axis, expected] : cases) {
    const auto note = mesh_note(model, axis);
    EXPECT_EQ(note.empty(), *expected == '\0') << note;
    EXPECT_NE(note.find(expected), std::string::npos) << note;
  }
}

const std::string kSample = "sample = { kind = 'lhs', count = 100 }\n";

TEST(ValueNotes, NamesEachKeyOnceThatIsProbablyInAnotherUnit) {
  EXPECT_EQ(value_notes("E = 7e4\nrho = 2.7\nlengths = [0.4, 400, 300]",
                        "H = 100\nmu = 0.4\ne = 1\nk = [27, 2.7e7, 3e11]\n"),
            "Note: E = 70000 Pa is outside the usual 1e8 to 1e12 Pa; 7e10?\n"
            "Note: H = 100 m is outside the usual 0.0001 to 10 m; 0.1?\n"
            "Note: k = 27 N/m is outside the usual 10000 to 1e10 N/m; 2.7e7?\n"
            "Note: length = 400 m is outside the usual 0.001 to 100 m; 0.4?\n"
            "Note: rho = 2.7 kg/m^3 is outside the usual 100 to 25000 kg/m^3; 2700?\n");
}

TEST(ValueNotes, CheckTheEndsOfRangesAndDistributions) {
  EXPECT_EQ(value_notes("", "H = 0.9\nmu = 0.4\ne = 1\nE = { from = 60, to = 80, count = 3 }\n"),
            "Note: E = 60 Pa is outside the usual 1e8 to 1e12 Pa; 6e10?\n");
  EXPECT_EQ(
      value_notes("", kSample +
                          "H = 0.9\nmu = { from = 0, to = 1 }\ne = 1\n"
                          "rho = { distribution = 'normal', mean = 2.7, sd = 0.1, from = 1 }\n"),
      "Note: rho = 2.7 kg/m^3 is outside the usual 100 to 25000 kg/m^3; 2700?\n");
}

TEST(ValueNotes, ReportThatARangeOfASampleIsAListOfValues) {
  EXPECT_EQ(value_notes("", kSample + "H = 0.9\nmu = { from = 0.1, to = 1, count = 5 }\ne = 1\n"
                                      "elements_per_link = { from = 4, to = 8, count = 5 }\n"),
            "Note: mu takes 5 values; 0.1:1 draws any value between them.\n")
      << "numbers of elements can only be drawn from a list";
  EXPECT_EQ(value_notes("", "H = 0.9\nmu = { from = 0.1, to = 1, count = 5 }\ne = 1\n"), "");
}

TEST(ValueNotes, IgnoreUsualValues) {
  for (const char* preset : {"paper", "printed", "converged"}) {
    EXPECT_EQ(value_notes(std::string("preset = '") + preset + "'",
                          kSample + "H = { from = 0.3, to = 1.1 }\nmu = [0, 2]\ne = 1\n"
                                    "tip_mass = [0, 0.02]\nI = \"A^2 / (4 * pi)\"\n"),
              "");
  }
}

}  // namespace
}  // namespace oblique::client
