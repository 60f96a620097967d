"""The paper's mathematics in its order; NumPy, SciPy and python-control only, no MuJoCo.

Arrays are batch-first, shapes ``(..., k)``. Vectors of the task space are written in the base
frame b: x forward along the heading, y to the left, z up, with inertial accelerations. Turning
them by the heading θ gives the paper's world coordinates.

Reading order, beside the paper (docs/paper_map.md has every equation):

=================  ================================================================================
II.A, IV.B         ``dynamics``: ``chain``, ``robot_model`` (1), (2), (7); ``frames``, ``towing``;
                   ``task_space`` (3), (4), (8), (28); ``redundancy``,
                   ``pseudoinverse_resolution`` IV.B; ``feedback_linearization`` (28);
                   ``measured_force``: (2) with the grasp force in the place of a model
II.B, III          ``payload``: ``object_model`` (5), (6), (10), (11); ``elastic_beam``;
                   ``passivity`` Lemma III.1; ``zero_dynamics`` (12)–(16); ``controllability``;
                   ``linkage``, ``linkage_motion``: (6) of links on any joints
III                ``certificates``: ``low_gain`` (24)–(26); ``iss_gain`` (17), (21);
                   ``acceleration_budget`` (19), (31); ``ladder``, ``certificate``,
                   ``conditions``: the ladder of bounds, built of ``peak_bounds`` (18),
                   ``impulse_response``, ``small_gain``, ``worst_case``, ``limits``,
                   ``phase_plane``, ``nonlinear_margin``; ``certified_command`` Remark IV.1;
                   ``error_budget``, what sampling costs of it
III, beyond        ``filters``: ``storage``, Lemma III.1's V as a barrier; ``safety_filter``,
                   ``conditions``, ``storage_keeping``, ``storage_filter``: the family and its
                   closed form, built of ``carried``,
                   ``sensed``, ``period_mean``, ``limits``, ``barrier``, ``decision``,
                   ``foresight``, ``batches``, ``swing_estimate``, ``reserves``;
                   ``object_filter``, of ``linkage_storage``, ``linkage_bounds``: any object;
                   ``nu_max_filter``; ``backup``, ``backup_decision``,
                   ``backup_filter``: rollouts of the nominal model; ``qp_filter``,
                   ``barrier_rows``: the literature's; ``family``; ``viability``,
                   ``viability_bounds``: what is possible at all, ``viability_share``
IV.A, V            ``control``: ``velocity_field`` IV.A, ``ways``, ``oriented_field``,
                   ``time_to_go``; ``control_laws`` (20), (27), (29); ``continuous_loop`` (30)–(34);
                   ``stability``, ``effective_damping``: what sampling and wrong parameters make
                   of it;
                   ``disk_margin``, ``gain_search``: gains for the object at hand;
                   ``disturbance_observer``, ``swing_following``, ``observed_loop``: without a model
IV, beyond         ``control``: ``settling_field``, ``moving_reference``: what regulators and
                   shapers follow; ``sampled_lqr``; ``input_shaping``; ``prediction``, ``horizon``,
                   ``receding_horizon``, ``quadratic_program``: plans with limits
=================  ================================================================================
"""
