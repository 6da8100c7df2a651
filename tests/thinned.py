"""Tests of many cases that each take long: of these every n-th stays in the suite, `make check-long` runs the others.

A case of each kind is enough to see that something broke; all of them are needed to see what.
"""

from __future__ import annotations

THINNED = {
    "test_accuracy": {"test_the_error_is_what_was_asked": 2},
    "test_accuracy_mesh": {"test_without_friction_every_element_is_exact": 3},
    "test_adversary_sampling": {"test_friction_where_a_support_holds_one_node_of_a_mean_is_felt_by_the_others": 3},
    "test_coulomb_soundness": {"test_no_single_solver_converges_where_no_solution_exists": 4},
    "test_curved_means": {
        "test_forms_of_the_exact_law_agree": 4,
        "test_rows_and_newtons_tangent_are_derivatives": 3,
        "test_the_tangent_of_driven_tools_is_that_of_differences": 2,
    },
    "test_curved_between": {"test_a_circle_smaller_than_an_edge_does_not_come_in_between_its_nodes": 4},
    "test_curved_forms": {
        "test_forms_agree_on_scenes_of_all_sorts": 3,
        "test_forms_of_the_exact_law_agree": 3,
    },
    "test_determinism": {"test_a_march_is_the_same_by_turns_with_another_and_in_a_thread_beside_it": 3},
    "test_fuzz_shaped_means": {"test_drawn_scenes_in_means_and_their_variants_pass_the_recomputation": 3},
    "test_hostile_sizes": {"test_the_upsetting_says_what_does_not_fit_before_it_asks_for_memory": 3},
    "test_inclined_in_space": {"test_a_scene_turned_in_space_keeps_its_forces": 3},
    "test_laws_capped": {"test_newton_finds_the_solution_that_trying_all_cases_finds": 2},
    "test_march": {"test_energy_balance_closes_to_a_thousandth": 2},
    "test_newton": {"test_newton_and_conic_forms_agree": 5},
    "test_paper_figs": {"test_figures_write_pdf_and_png": 2, "test_no_text_is_cut_off_or_covers_another": 2},
    "test_paper_figs_any_run": {"test_every_figure_of_every_kind_is_whole_and_legible": 3},
    "test_profile_marches": {
        "test_a_tool_goes_in_by_a_tenth_and_every_increment_is_certified": 3,
        "test_forms_of_the_exact_law_agree": 3,
    },
    "test_profile_inputs": {"test_a_face_in_two_parts_is_slid_along_as_in_one": 3},
    "test_profiles": {"test_the_least_gap_along_an_edge_is_that_of_a_fine_sampling": 3},
    "test_projection": {"test_every_form_finds_the_same_certified_increment": 5},
    "test_resume": {"test_a_study_leaves_goes_on_with_or_replaces_its_results": 2},
    "test_resume_march": {"test_a_march_goes_on_from_every_course_to_the_last_bit": 4},
    "test_sampling": {"test_all_forms_agree": 4},
    "test_shear_scenes": {"test_quadratic_elements": 2},
    "test_shear_solid": {"test_newton_tangent_and_dissipation_agree": 5},
    "test_soundness": {
        "test_contact_forces_agree_between_units_in_a_nearly_incompressible_body": 2,
        "test_tiny_travel_gives_the_elastic_stiffness_and_is_certified_sharply": 5,
    },
    "test_space_curved_means": {
        "test_a_scene_turned_or_mirrored_as_a_whole_has_the_same_forces": 2,
        "test_every_form_finds_the_same_forces_under_a_sphere": 4,
        "test_rows_and_newtons_tangent_are_derivatives": 2,
    },
    "test_space_driven_turns": {"test_the_tangent_is_that_of_differences": 3},
    "test_space_tools": {"test_every_form_finds_the_same_forces_under_a_sphere": 4},
    "test_study_upsetting": {"test_every_form_runs_from_the_command_line": 2},
    "test_symmetry": {"test_the_mirror_image_meshed_has_the_same_forces_and_energies": 3},
}
"""n by module and test."""
