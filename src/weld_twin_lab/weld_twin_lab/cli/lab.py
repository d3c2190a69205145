# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The proofs as a table, a row each: what runs it, its help and its options.

A proof is a function of a `Study`; its room is loaded when it runs, not for its help.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib import import_module
from typing import NamedTuple

from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.cli.options import POOL, ROBOT, folder_output
from weld_twin_nodes.cli.parsing import Command, Options, add_command

from ..study import MISSED, Study


class Proof(NamedTuple):
    run: str
    """Module below the package, and the function that returns False where a goal is missed."""
    text: str
    """Its help; the first line is what the list of proofs says of it."""
    options: tuple[Options, ...] = ()
    jobs: Mapping[str, Proof] = {}


def _proof(run: str, text: str, *options: Options) -> Proof:
    return Proof(run, text, options)


def _campaign(text: str, *options: str) -> Proof:
    out = '--out FILE, required  JSON file to write, or to replace if it is of the same campaign'
    return _proof('campaigns:run', text, *options, out)


OUT = '--out DIR, required  where results go'
EVERYTHING = '--out DIR, required  where everything goes'
DRAW = """
--cases N         how many [default: 400]
--seed N, required  decides the cases
--kinds LIST      only these, comma-separated: single, double, triple, none, outside, withheld, ambiguous
--leave-one-out   each family of effects in turn at work and taken out of the library
--seconds MIN,MAX  duration of a recording [default: 20,60]
"""
CASES = 'CASES  cases made by blind make'
BLIND = {
    'make': _proof(
        'blind.study:make',
        """Make cases and seal their truths.

        Prints the seal, a hash over all cases and truths; publish it before anybody diagnoses.
        """,
        DRAW,
        '--truths DIR, required  where the truths go; keep it where a diagnosis cannot read',
        POOL,
        '--out DIR, required  where the recordings go',
    ),
    'diagnose': _proof(
        'blind.study:diagnose',
        """Diagnose cases from their recordings alone.

        Refuses to run where the truths could be read. Stopped, it goes on where it was when run again.
        """,
        CASES,
        '--allow-readable   go on although truths lie within reach; the score tells',
        '--without-holdout  judge the shrink on stretches of the training recording',
        POOL,
        '--out DIR, required  where the verdicts go',
    ),
    'score': _proof(
        'blind.study:score',
        """Open the seals and score the verdicts.

        Exits with 2 when a case, a truth or the list of them is not what was sealed.
        """,
        CASES,
        '--truths DIR, required   their truths',
        '--results DIR, required  verdicts of blind diagnose',
        '--seal HASH              the seal as it was printed before the diagnosis',
        '--out DIR, required  where score.json and score.md go',
    ),
    'run': _proof(
        'blind.study:whole',
        """Make, diagnose and score in one go.

        The truths lie beside the cases then; nothing but the code keeps the diagnosis from reading them.
        """,
        DRAW,
        POOL,
        EVERYTHING,
    ),
}
CAMPAIGNS = {
    'compensator': _campaign(
        """Send drawn goals through a compensator in a cell, and change the cell under it.

        A diagnosis learns each of six arms with sure causes. Goals run as they are and through the
        compensator. Then a clock jumps, the load changes, the model is a wrong one, the tracker is lost.
        """,
        '--goals N         goals of all arms [default: 500]',
        '--without-cell N  goals of all arms that are judged without nodes, 0 for none [default: 500]',
        '--seed N          decides what is drawn [default: 7]',
        '--go-on           keep the goals and changes that the file has, and try the others',
    ),
    'faults': _campaign(
        """Faults done to a running cell, and what each node did.

        A node passes a fault if it lives, published nothing but what a sound joint state of the same
        stamp gives, told of the fault on /diagnostics where it is one of its inputs', and is ok again
        afterwards.
        """,
        '--only TEXT  faults whose names contain this',
    ),
    'fuzz': _campaign(
        """Read broken files of every kind.

        Samples that are right are changed at random, as bytes, as text and as trees, and read. A file
        must give a result or one clear sentence: never a traceback, a hang or a gigabyte. With
        --recordings, recordings that hardly say anything are diagnosed, too: one axis to nine, one
        station to sixty, joints that stand still, exact zeros, repeats, shuffled rows.
        """,
        '--cases N       broken files of each kind [default: 5000]',
        '--seed N        decides how they are broken [default: 1]',
        '--only LIST     kinds, comma-separated',
        '--recordings N  recordings that hardly say anything, from --seed on [default: 0]',
    ),
    'kill': _campaign(
        """Kill the recorder at random moments and look at what is left.

        Joint states at 500 Hz and poses at 100 Hz are recorded with both storages, in files small enough
        that splits are hit too. SIGKILL comes while recording, or while the bag is being completed. What
        `weld-twin bag recover` finds must be the messages sent, in order and without a gap from the
        first on, and may lack one second at most.
        """,
        '--times N    kills of the recorder [default: 200]',
        '--seed N     decides the moments [default: 1]',
        '--longest S  latest moment of a kill of the recorder [default: 3]',
    ),
    'latency': _campaign(
        """Joint state in to twin pose out, beside a bare relay that copies the message.

        Relay and twin take turns of a second on one machine in one run, so that the ratios hold on a
        busy machine too. One twin takes its base from `/tf` and goes on listening to an arm's frames
        there. Times are from the call that sends the joint state to the call that receives the answer. A
        second part lets the twin answer with and without a live diagnosis under way. A third lets a
        compensator answer to poses, beside a relay that copies those.
        """,
        '--turns N    turns of each, at each rate [default: 20]',
        '--seconds S  length of a turn [default: 1]',
    ),
    'security': _campaign(
        """The nodes under enforced security: who has no keys, or others, hears and says nothing.

        The same is tried without keys first: there every stranger must hear the twin and be recorded, or
        else the trial shows nothing. It needs sros2 and a middleware that is built with DDS security;
        where they are missing, the result says so and does not pass. With ``--source`` both are built
        first.
        """,
        '--source DIR  folder with rmw_cyclonedds and sros2 (branch jazzy), to be built and used',
        '--work DIR    where to build it; kept, and used again next time',
    ),
    'soak': _campaign(
        """All nodes together for a long time: memory, lost samples, CPU time.

        The generator goes along a seam there and back in real time; injector, twin, analyzer, markers,
        recorder and live diagnosis work on what it sends.
        """,
        '--minutes M  length of the trial [default: 30]',
        '--rate HZ    joint states a second [default: 500]',
        '--cores N    cores all nodes share [default: 2]',
    ),
}
PROOFS = {
    'baseline': _proof(
        'belief.baseline:run',
        """What an engine says of cells with one to six causes, beside what other engines said.

        Draws sealed cells, diagnoses them with the engine at hand and keeps its answers in a small
        table. Tables of other engines, made by the same command on their code, are set beside it.
        Stopped, it goes on where it was when run again.
        """,
        """
--cases N                diagnose the first N cells of a seed [default: 0]
--seed N                 their seed [default: 1]
--beside NAME=TABLE ...  tables that other engines made of the same cells
--growing                diagnose every cell with one to four recordings, and in reverse: does more
  data hurt?
""",
        POOL,
        EVERYTHING,
    ),
    'belief': _proof(
        'belief.study:run',
        """How far a diagnosis can be trusted: learned on cases with known truths, judged on others.

        Draws cases, diagnoses them, and fits for every kind of statement how often it is right, with the
        threshold from which it is told as sure. Writes weights.json (the file the diagnosis reads), what
        answers are worth on the cases to judge on, and the tables of statements: with --learn-from and
        --judge-on it is fitted anew from such tables without a diagnosis. Without cases to judge on,
        those learned from are judged by weights that had not seen them. Stopped, it goes on where it was
        when run again.
        """,
        """
--cases N               cases to learn from [default: 0]
--seed N                their seed [default: 1]
--held-out N            cases to judge on [default: 0]
--held-out-seed N       their seed [default: 2]
--mix {usual,several,everywhere,foreign}  which cells: see docs/trust.md [default: usual]
--oracle N              of so many of these an oracle that knows the plant is asked, too [default: 0]
--learn-from TABLE ...  tables kept from other runs
--judge-on TABLE ...    tables kept from other runs
--risk X                probability that an answer may be sure and wrong [default: 0.003]
""",
        POOL,
        EVERYTHING,
    ),
    'benchmark': _proof(
        'benchmark:run',
        """Time the twin beside its peers, after checking that they agree.

        Peers that are not installed are left out. One thread; contenders take turns, so that the ratios
        hold on a busy machine too. Writes benchmark.json and a table (benchmark.md) to the directory.
        """,
        folder_output('where results go'),
        '--quick  small sizes, to see that it runs',
    ),
    'blind': Proof(
        '',
        """Check the diagnosis on recordings whose causes are withheld from it.

        Cases come from a simulator that shares no formula with the twin. Their truths are sealed before
        any diagnosis, and opened when the verdicts are in.
        """,
        jobs=BLIND,
    ),
    'campaign': Proof(
        '',
        """Try the nodes and the files hard, and keep what came of it.

        Writes one JSON file. Exits with 1 when the campaign found a failure; the file tells which.
        """,
        jobs=CAMPAIGNS,
    ),
    'cells': _proof(
        'cells.study:run',
        """Are causes told in whole cells, and from pixels, as on one arm under a tracker?

        Sealed cells of the plant: an arm, one on a track beside a positioner, two arms; then stations
        seen by two cameras and by a tracker. With --data, a real arm is told from its pixels and judged
        by a tracker. Writes cells.json and cells.md; a run that was interrupted goes on where it
        stopped.
        """,
        """
--cells N    sealed cells of every kind [default: 14]
--cameras N  sealed arms before cameras [default: 40]
--seed N     the first that is drawn [default: 0]
--data DIR   published recordings: holds motoman_left
""",
        POOL,
        OUT,
    ),
    'contest': _proof(
        'contest.scores:run',
        """Methods of different make on the same sealed cases, by the same rules.

        Puts cases of `weld-twin lab blind make` into an open form, has every method answer them in a
        process of its own, and scores the answers. Anybody's method can enter: --enter NAME='COMMAND
        {case} {out}'. With --ur5 and --ur10, stations of two measured arms are asked, too. A run that
        was stopped goes on: what is in --out is not made again. Remove the directory of a method to have
        it answer anew.
        """,
        """
--cases DIR, required   as blind make wrote them
--truths DIR, required  their truths
--first N               only so many cases [default: 0]
--entrants LIST         comma-separated; left out, all
--enter NAME=COMMAND    a further method; may be given again
--ur5 DIR               holds grid.csv, random.csv
--ur10 DIR              holds series_c_random_poses.csv
""",
        OUT,
    ),
    'coverage': _proof(
        'coverage.study:run',
        """Promises with an interval: do nine of ten lie in theirs, and how wide are they?

        Poor recordings of two measured arms, judged on poses inside and outside of them; cells of the
        plant, whose poses are judged where the tool really is, with shrinks, shares and parameters;
        programs before and after they are corrected; arms that touched things; wear foretold; plans of a
        first measurement. Writes coverage.json and coverage.md; a run that was interrupted goes on where
        it stopped.
        """,
        """
--ur5 DIR    holds grid.csv; with --ur10
--ur10 DIR   holds series_c_random_poses.csv
--cases N    the first N sealed cases of a seed [default: 0]
--seams N    seams of every language of programs [default: 0]
--touches N  arms that touch things [default: 0]
--cells N    cells that live through ten years each [default: 0]
--plans N    plans of a first measurement [default: 0]
--seed N     of all that is drawn [default: 1]
""",
        POOL,
        OUT,
    ),
    'efforts': _proof(
        'real_arms.unseen:run',
        """Do springs by measured efforts predict a real arm better than springs by the model's statics?

        Leaves out stretches of time in turn, diagnoses the rest with and without efforts, and judges
        both on the stretch, beside plain fits of frames and geometry: efforts.md. Beside it lies the
        diagnosis of all stations with efforts, with its page, as weld-twin diagnose writes it.
        """,
        'TABLE  stations with measured poses and efforts',
        ROBOT,
        '--folds N  stretches [default: 5]',
        folder_output('where table and page go'),
    ),
    'gate': _proof(
        'gate.trials:run',
        """Make every mistake of data and set-up, and see whether the gate names it and spares the sound.

        Recordings come from the plant, as bags and as tables; each mistake is drawn anew. Sound ones
        have causes of all families in plausible size, on rich and poor motions, with and without
        alignment.
        A run that was interrupted goes on where it stopped.
        """,
        """
--seed N      decides what is drawn [default: 20]
--draws N     of every kind, as bag and as table [default: 10]
--sound N     sound recordings [default: 300]
--kinds LIST  only these mistakes, comma-separated
""",
        POOL,
        '--out OUT, required  directory for gate.json and gate.md',
    ),
    'investigate': _proof(
        'experiments.study:run',
        """Investigations: do the experiments that are asked for decide?

        Cells of the plant with sealed causes are recorded on poor motions. Those that the diagnosis
        leaves open, or gets wrong, are investigated: the plant runs what is asked, three experiments and
        five minutes at most. Writes investigate.json and investigate.md; a run that was interrupted goes
        on where it stopped, and one with --minutes writes what there is after so long.
        """,
        """
--seed N            decides the cells [default: 1]
--cells N           cells that are left open at first [default: 120]
--minutes M         begin no further cells after so many minutes, and write what there is [default: inf]
--learn-from TABLE ...  learn the weights of the rule that closes a question from investigate.json of
  other cells, and write closing.md with what they are worth on cells that they were not learned from
""",
        POOL,
        OUT,
    ),
    'programs': _proof(
        'programs.corrections:run',
        """Robot programs: does a corrected one help?

        In every language seams of arms with sealed causes are recorded, diagnosed, corrected as programs
        and driven by the plant. Writes corrections.json and corrections.md; a run that was interrupted
        goes on where it stopped.
        """,
        """
--seams N  sealed seams a language [default: 1]
--seed N   decides the seams [default: 1]
""",
        POOL,
        OUT,
    ),
    'real-arms': _proof(
        'real_arms.study:run',
        """Real arms that nobody tuned on: which causes are told, and do unseen data bear them out?

        Diagnoses some sixty parts of third-party recordings, and takes every kind that is told out of a
        plain fit of all kinds: unseen data must get worse. Writes real_arms.json, real_arms.md and
        told.jsonl, a table that 'lab belief --learn-from' takes. With --poor, forty splits of two arms
        and a servo axis that are poor on purpose are judged beside plain fits: poor.json, poor.md, and
        exit code 1 when a goal is missed. Stopped, it goes on where it was when run again.
        """,
        """
--data DIR, required  holds ur5_laser_tracker, emps, mukca, ...
--only TEXT           only rows whose names contain this
--poor                judge recordings that are poor on purpose
""",
        POOL,
        OUT,
    ),
    'waits': _proof(
        'benchmark.waiting:run',
        """What people wait for: whole commands started cold, beside those of another checkout.

        Runs each command here and there in turn. Ratios of pairs count: the machine's own speed drifts.
        Writes waits.json and waits.md. With --only, the other rows of a waits.json in --out stay as they
        are; every row says when and with which versions it was measured.
        """,
        """
--base DIR       another checkout, after make setup; left out, only this
--runs N         pairs of runs [default: 3]
--only TEXT ...  jobs whose name has one of these
""",
        OUT,
    ),
    'years': _proof(
        'fleet.years:run',
        """Live through simulated years of weekly checks, and see which changes the history finds.

        Most years are drawn: how sure each diagnosis is comes from real ones. Some are simulated by the
        plant and diagnosed in full. A run that was interrupted goes on where it stopped.
        """,
        """
--seed N   decides the cells and the years [default: 26]
--years N  drawn years [default: 200]
--cells N  cells they are of [default: 12]
--full N   years diagnosed in full [default: 2]
""",
        POOL,
        '--out OUT, required  directory for the results',
    ),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    places = parser.add_subparsers(required=True, metavar='PROOF', dest='proof', title='proofs')
    for name, proof in PROOFS.items():
        own = add_command(places, name, Command(proof.text, options=proof.options))
        if proof.jobs:
            jobs = own.add_subparsers(required=True, metavar='JOB', dest='job')
            for word, job in proof.jobs.items():
                add_command(jobs, word, Command(job.text, options=job.options))


def run(args: Given) -> int:
    proof = PROOFS[args.proof]
    module, _, name = (proof.jobs[args.job] if proof.jobs else proof).run.partition(':')
    function = getattr(import_module(f'weld_twin_lab.{module}'), name)
    return MISSED if function(Study(args)) is False else 0
