#include "client/load/load_views.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace intervale {
namespace {

using std::chrono::milliseconds;

// A client that asks five times a second, and connects as the clock begins.
struct Client {
  LoadStats stats;
  LoadViews views;
  explicit Client(Scenario scenario = Scenario::orbit) : views({.scenario = scenario, .box = {{0, 0, 0}, {1, 1, 1}}}, {}, stats) {}
};

LoadViews::Time at(int ms) { return LoadViews::Time(milliseconds(ms)); }

TEST(LoadViews, WaitSinceTheyWereDueHoweverLateTheyAreSent) {
  Client c;
  c.views.begin(at(50));
  EXPECT_FALSE(c.views.advance(at(249)));
  EXPECT_EQ(c.views.next_due(), at(250));
  EXPECT_TRUE(c.views.advance(at(256)));
  c.views.asked(2);
  EXPECT_TRUE(c.views.advance(at(700)));  // those of 450 and 650
  c.views.asked(3);
  EXPECT_EQ(c.views.next_due(), at(850));
  c.views.serve(2, at(710));
  c.views.note_bytes(1000);
  c.views.serve(3, at(750));
  EXPECT_EQ(c.stats.view_change_ms, (std::vector<double>{460, 300, 100}));
  EXPECT_EQ(c.stats.stale_bytes, (std::vector<double>{0, 1000, 1000}));
  EXPECT_EQ(c.stats.views, 4u);
  EXPECT_EQ(c.stats.late_views, 3u);
}

TEST(LoadViews, AreOverOnceAllAreDoneAndThereIsAMesh) {
  Client c;
  c.views.begin(at(0));
  EXPECT_TRUE(c.views.advance(at(200)));
  c.views.asked(2);
  c.views.end();
  EXPECT_EQ(c.views.next_due(), LoadViews::Time::max());
  EXPECT_FALSE(c.views.advance(at(1000)));
  c.views.serve(2, at(1000));
  c.views.note_mesh(300, at(1010));
  EXPECT_FALSE(c.views.are_over());
  EXPECT_FALSE(c.views.is_complete());
  c.views.finish(2, true, at(1020));
  EXPECT_TRUE(c.views.are_over());
  EXPECT_TRUE(c.views.is_complete());
  EXPECT_EQ(c.stats.first_mesh_ms, (std::vector<double>{1010}));
}

TEST(LoadViews, AreNotDueAfterTheEndHoweverLateSomebodyLooks) {
  Client c;
  c.views.begin(at(0), at(600));
  EXPECT_TRUE(c.views.advance(at(5000)));  // those of 200 and 400
  EXPECT_EQ(c.views.next_due(), LoadViews::Time::max());
  EXPECT_FALSE(c.views.advance(at(9000)));
  EXPECT_EQ(c.stats.views, 3u);
}

TEST(LoadViews, AreDoneWithTheDoneForThemOrForANewerOne) {
  Client c;
  c.views.begin(at(0));
  c.views.asked(1);
  c.views.finish(1, true, at(100));
  EXPECT_TRUE(c.views.advance(at(200)));
  c.views.asked(2);
  c.views.serve(2, at(210));
  EXPECT_TRUE(c.views.advance(at(400)));
  c.views.asked(3);
  c.views.serve(3, at(450));
  EXPECT_EQ(c.stats.view_done_ms, std::vector<double>{});
  c.views.finish(3, true, at(500));
  EXPECT_EQ(c.stats.view_change_ms, (std::vector<double>{10, 50}));
  EXPECT_EQ(c.stats.view_done_ms, (std::vector<double>{300, 100}));
  EXPECT_TRUE(c.views.advance(at(600)));
  c.views.asked(4);
  c.views.serve(4, at(605));
  c.views.report_rest(false, at(1000));
  EXPECT_EQ(c.stats.view_change_ms.back(), 5);
  EXPECT_EQ(c.stats.view_done_ms.back(), 400) << "so far";
  EXPECT_EQ(c.stats.unanswered_views, 0u);
}

// Each has a newer epoch, and answers to it are those that the view waits for.
TEST(LoadViews, OneThatIsSentAgainIsStillTheSameView) {
  Client c;
  c.views.begin(at(0));
  c.views.asked(1);  // again as 2
  c.views.serve(1, at(10));
  c.views.note_bytes(5000);
  c.views.serve(2, at(20));
  c.views.note_bytes(6000);
  EXPECT_TRUE(c.views.advance(at(200)));
  c.views.asked(3);  // again as 4 and 5
  c.views.serve(2, at(205));
  c.views.note_bytes(700);
  c.views.serve(3, at(210));
  c.views.note_bytes(30);
  EXPECT_TRUE(c.views.advance(at(400)));
  c.views.serve(4, at(405));
  c.views.note_bytes(4);
  c.views.asked(6);           // again as 7, while the Done for 6 is under way
  c.views.serve(5, at(410));  // it does not answer the view of 6
  c.views.note_bytes(50);
  EXPECT_EQ(c.stats.view_change_ms, (std::vector<double>{10}));
  c.views.finish(6, true, at(420));
  EXPECT_TRUE(c.views.is_complete()) << "what is sent again lacks nothing";
  c.views.finish(7, true, at(430));
  EXPECT_TRUE(c.views.is_complete());
  c.views.report_rest(false, at(1000));
  EXPECT_EQ(c.stats.view_change_ms, (std::vector<double>{10, 20}));
  EXPECT_EQ(c.stats.view_done_ms, (std::vector<double>{220, 20}));
  EXPECT_EQ(c.stats.stale_bytes, (std::vector<double>{700, 54}));
  EXPECT_EQ(c.stats.view_bytes, (std::vector<double>{84, 0}));
  EXPECT_EQ(c.stats.views, 3u);
  EXPECT_EQ(c.stats.done_views, 1u);
  EXPECT_EQ(c.stats.unanswered_views, 0u);
  EXPECT_EQ(c.stats.complete, 1u);
}

TEST(LoadViews, AreCompleteWithTheDoneForTheNewestOnly) {
  Client c;
  c.views.begin(at(0));
  c.views.asked(1);
  EXPECT_TRUE(c.views.advance(at(200)));
  c.views.asked(3);
  c.views.finish(2, true, at(210));
  EXPECT_FALSE(c.views.is_complete());
  c.views.finish(4, false, at(220));
  EXPECT_FALSE(c.views.is_complete()) << "there was no room";
  EXPECT_EQ(c.stats.done_views, 2u);
}

// The first view brings the mesh, and later ones change it.
TEST(LoadViews, TheBytesOfEachAnsweredViewButTheFirstCount) {
  Client c;
  c.views.begin(at(0));
  c.views.asked(1);
  c.views.serve(1, at(10));
  c.views.note_bytes(5000);
  EXPECT_TRUE(c.views.advance(at(600)));
  c.views.asked(2);
  c.views.serve(1, at(610));
  c.views.note_bytes(700);
  c.views.serve(2, at(620));
  c.views.note_bytes(30);
  c.views.serve(2, at(630));
  c.views.note_bytes(40);
  c.views.finish(2, true, at(640));
  EXPECT_TRUE(c.views.advance(at(1000)));
  c.views.asked(3);
  c.views.finish(3, true, at(1010));  // nothing was missing
  c.views.report_rest(false, at(2000));
  EXPECT_EQ(c.stats.view_bytes, (std::vector<double>{70, 0}));
  EXPECT_EQ(c.stats.stale_bytes, (std::vector<double>{700, 700, 700, 0, 0}));
}

TEST(LoadViews, OfDragsOfTheRangeAreTenAndThenARest) {
  Client c(Scenario::range);
  c.views.begin(at(0));
  for (int move = 1; move <= 25; ++move) {
    const auto due = at(200 * move + 1000 * ((move - 1) / 10));
    EXPECT_EQ(c.views.next_due(), due);
    EXPECT_TRUE(c.views.advance(due));
  }
  EXPECT_EQ(c.stats.late_views, 0u);
  EXPECT_EQ(c.views.number(), 25u);
}

TEST(LoadViews, WhatIsUnansweredCountsWithItsTimeUnlessTheClientFailed) {
  for (const bool failed : {false, true}) {
    Client c;
    c.views.begin(at(0));
    EXPECT_TRUE(c.views.advance(at(400)));
    c.views.asked(2);
    c.views.report_rest(failed, at(1000));
    EXPECT_EQ(c.stats.unanswered_views, 2u);
    EXPECT_EQ(c.stats.view_change_ms, failed ? std::vector<double>{} : (std::vector<double>{800, 600}));
    EXPECT_EQ(c.stats.view_done_ms, c.stats.view_change_ms);
    EXPECT_EQ(c.stats.first_mesh_ms, failed ? std::vector<double>{} : std::vector<double>{1000});
  }
}

TEST(LoadViews, ALostServerIsMissedUntilAViewIsServed) {
  Client c;
  c.views.begin(at(0));
  c.views.asked(1);
  c.views.finish(1, true, at(10));
  c.views.lose(at(20));
  c.views.lose(at(40));  // the next one too
  c.views.serve(1, at(100));
  EXPECT_EQ(c.stats.resume_ms, (std::vector<double>{80}));
  c.views.report_rest(false, at(200));
  EXPECT_EQ(c.stats.complete, 0u) << "another session has to say so again";
}

TEST(LoadViews, TheWholeStreamIsOneView) {
  Client c(Scenario::full);
  c.views.begin(at(5));
  c.views.asked(1);
  EXPECT_FALSE(c.views.advance(at(10'000)));
  c.views.finish(1, true, at(10'005));
  c.views.report_rest(false, at(10'010));
  EXPECT_EQ(c.stats.view_change_ms, (std::vector<double>{10'000}));
  EXPECT_EQ(c.stats.complete, 1u);
}

}  // namespace
}  // namespace intervale
